"""Laws of the names of cameras, which are folders of a recording."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from played_sources import lens, write_capture

from conftest import everything_in
from servoid.capture import open_capture
from servoid.errors import CaptureError, OutputError
from servoid.opening import GivenCalibration, open_recorded, parse_source
from servoid.pose import Pose
from servoid.record import FolderRecorder
from servoid.source import MountedCamera, RawImage, RawInstant, read_rig

WRONG = {
    "../../escaped": "a slash",
    "/escaped": "a slash",
    "a\\b": "a slash",
    "..": "begins with a dot",
    ".": "begins with a dot",
    ".hidden": "begins with a dot",
    "eye\0": "a character that cannot be printed",
    "eye\n": "a character that cannot be printed",
    "a" * 101: "too long",
    "ä" * 51: "too long",
    " ": "empty",
}
RIGHT = ("left", "hand_left", "camera 1", "head-left", "Kamera Süd", "cam[0]", "a*", "a" * 100)
EYE = MountedCamera("eye", lens(), Pose.identity())
BLACK = np.zeros((48, 64, 3), np.uint8)


def toml(name: str, more: str) -> str:
    return (
        f"version = 1\n[[camera]]\nname = {json.dumps(name)}\n{more}size_px = [64, 48]\n"
        "fov_deg = 60.0\n"
    )


def raw(depth: bool = False) -> RawInstant:
    depth_m = np.ones((48, 64), np.float32) if depth else None
    return RawInstant(0, 0.5, (RawImage(BLACK, 0.5, 1, depth_m),), (Pose.identity(),))


@pytest.mark.parametrize("name", WRONG)
def test_a_name_that_is_no_folder_is_refused_wherever_names_are_read(
    name: str, tmp_path: Path
) -> None:
    message = f"a camera cannot be named .*{WRONG[name]}; name it with letters"
    files = {"images": 'images = "*.png"\n', "device": "device = 0\n"}
    for key, more in files.items():
        (tmp_path / f"{key}.toml").write_text(toml(name, more))
    with pytest.raises(CaptureError, match=message):
        open_capture(tmp_path / "images.toml")
    with pytest.raises(CaptureError, match=message):
        read_rig(tmp_path / "device.toml")
    pair = tmp_path / "pair.toml"
    pair.write_text(f'version = 1\n[[pair]]\nname = {json.dumps(name)}\ndevice = "realsense:1"\n')
    with pytest.raises(CaptureError, match=message):
        read_rig(pair)
    write_capture(tmp_path / "run", 2)
    known = GivenCalibration(calibration=tmp_path / "device.toml")
    with pytest.raises(CaptureError, match=message):
        open_recorded(parse_source(str(tmp_path / "run" / "left" / "*.png")), known)


@pytest.mark.parametrize("name", WRONG)
def test_a_recorder_writes_nothing_for_a_camera_that_names_no_folder(
    name: str, tmp_path: Path
) -> None:
    home = tmp_path / "a" / "b"
    home.mkdir(parents=True)
    before = everything_in(tmp_path)
    with pytest.raises(OutputError, match=f"cannot record into .*{WRONG[name]}"):
        FolderRecorder(home / "run", [replace(EYE, name=name)])
    assert everything_in(tmp_path) == before


@pytest.mark.parametrize(
    "names", [("poses.csv",), ("eye", "eye"), ("eye", "eye-depth"), ("eye-depth", "eye")]
)
def test_a_recorder_never_mixes_the_files_of_two_cameras(
    names: tuple[str, ...], tmp_path: Path
) -> None:
    with pytest.raises(OutputError, match="would be mixed with others; give it another name"):
        FolderRecorder(tmp_path / "run", [replace(EYE, name=name) for name in names])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", RIGHT)
def test_a_recording_of_any_allowed_name_can_be_opened(name: str, tmp_path: Path) -> None:
    recorder = FolderRecorder(tmp_path / "run", [replace(EYE, name=name)])
    recorder.add(raw(depth=True))
    (camera,) = open_capture(recorder.close()).cameras
    assert camera.name == name
    assert len(camera.pictures) == 1 and camera.depth_paths[0] is not None

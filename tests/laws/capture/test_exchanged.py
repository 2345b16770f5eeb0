"""Images that the two cameras of a pair have exchanged are noticed, and only those."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import Command
from drawn_pairs import Pair
from refusals import check_refused
from rooms_to_scan import FOCAL_PX, SIZE_PX, Room, around, draw, write_photos

from servoid.capture import Capture, doubt_calibration, open_capture
from servoid.errors import CameraError
from servoid.model import Request, fit_capture
from servoid.pose import Pose

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
PAIRS = ("mustard", "mustard_hand", "drill", "teabox")
RIGS = {
    "b right of a": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    "b left of a": [-0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    "b above a": [0.0, -0.1, 0.0, 0.0, 0.0, 0.0],
    "toed in": [0.1, 0.0, 0.0, 0.0, -0.14, 0.0],
}
CAMERA = """[[camera]]
name = "{name}"
images = "{name}/*.jpg"
size_px = [{width}, {height}]
focal_px = [{focal}, {focal}]
rig_from_camera = {pose}
"""


def with_exchanged_images(capture: Capture) -> Capture:
    a, b = capture.cameras
    cameras = replace(a, pictures=b.pictures), replace(b, pictures=a.pictures)
    return replace(capture, cameras=cameras)


@pytest.mark.parametrize("name", RIGS)
def test_cameras_with_exchanged_images_are_named_whatever_the_rig(
    name: str, tmp_path: Path
) -> None:
    true = Pose.exp(RIGS[name]).matrix()
    walk = around(2, 20.0)
    tables = ["version = 1", "rate_hz = 10"]
    for camera, rig_from_camera in (("one", np.eye(4)), ("other", true)):
        write_photos(tmp_path / camera, draw(Room(), [pose @ rig_from_camera for pose in walk]))
        width, height = SIZE_PX
        pose = rig_from_camera.tolist()
        tables.append(
            CAMERA.format(name=camera, width=width, height=height, focal=FOCAL_PX, pose=pose)
        )
    (tmp_path / "capture.toml").write_text("\n".join(tables))
    capture = open_capture(tmp_path)
    assert doubt_calibration(capture) is None
    doubt = doubt_calibration(with_exchanged_images(capture))
    assert doubt is not None
    assert doubt.startswith("the images of one and other are exchanged: of ")


def test_a_pair_with_exchanged_files_is_refused_by_both_names(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair().write(tmp_path / "pair")
    out = ("--out", tmp_path / "body.json")
    assert servoid_command("model", folder, *out, "--max-ellipsoids", 2).code == 0
    (tmp_path / "body.json").unlink()
    (folder / "left").rename(folder / "moved")
    (folder / "right").rename(folder / "left")
    (folder / "moved").rename(folder / "right")
    check_refused(
        servoid_command, tmp_path, r"the images of left/0000 and right/0000 are exchanged: of \d+",
        "model", folder, *out,
    )  # fmt: skip


def test_a_pair_with_exchanged_poses_is_refused(tmp_path: Path) -> None:
    capture = open_capture(Pair().write(tmp_path / "pair"))
    a, b = capture.cameras
    poses = (
        replace(a, rig_from_camera=b.rig_from_camera),
        replace(b, rig_from_camera=a.rig_from_camera),
    )
    with pytest.raises(CameraError, match="are exchanged"):
        fit_capture(replace(capture, cameras=poses), Request(max_ellipsoids=1))


@pytest.mark.extended
@pytest.mark.parametrize("name", PAIRS)
def test_recorded_pairs_are_exchanged_only_if_they_are(name: str) -> None:
    if not (DATA / "stereo" / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(DATA / "stereo" / name)
    assert doubt_calibration(capture) is None
    assert "are exchanged" in str(doubt_calibration(with_exchanged_images(capture)))

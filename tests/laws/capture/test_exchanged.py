"""Images that the two cameras of a pair have exchanged are noticed, and only those."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Command
from drawn_pairs import Pair
from numpy.typing import NDArray
from refusals import check_refused
from rooms_to_scan import write_pair

from servoid.camera import Picture
from servoid.capture import Capture, doubt_calibration, open_capture
from servoid.errors import CameraError
from servoid.model import Request, fit_capture
from servoid.pose import Pose

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
PAIRS = ("mustard", "mustard_hand", "drill", "teabox")
# The cameras of the tea box are turned to each other; 2 degrees more hardly move its lines.
RECORDED = (
    *(f"stereo/{name}" for name in PAIRS if name != "teabox"),
    *(f"hard/{name}" for name in ("bleach_turn", "mug_sway", "mustard_half", "sugar_jump")),
)
RIGS = {
    "other right of one": [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    "other left of one": [-0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
    "other above one": [0.0, -0.1, 0.0, 0.0, 0.0, 0.0],
    "toed in": [0.1, 0.0, 0.0, 0.0, -0.14, 0.0],
}


def with_exchanged_images(capture: Capture) -> Capture:
    a, b = capture.cameras
    cameras = replace(a, pictures=b.pictures), replace(b, pictures=a.pictures)
    return replace(capture, cameras=cameras)


@pytest.mark.parametrize("name", RIGS)
def test_cameras_with_exchanged_images_are_named_whatever_the_rig(
    name: str, tmp_path: Path
) -> None:
    capture = write_pair(tmp_path, Pose.exp(RIGS[name]).matrix())
    assert doubt_calibration(capture) is None
    doubt = doubt_calibration(with_exchanged_images(capture))
    assert doubt is not None
    assert doubt.startswith("the images of one and other are exchanged: of ")


@pytest.mark.parametrize(("name", "count"), [("other above one", 6), ("toed in", 6)])
def test_parallel_cameras_as_given_are_settled_once_their_images_have_features_enough(
    name: str, count: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = write_pair(tmp_path, Pose.exp(RIGS[name]).matrix())
    read: list[str] = []
    whole = Picture.read

    def noted(picture: Picture, *given: Any) -> NDArray[np.uint8]:
        read.append(picture.stem)
        return whole(picture, *given)

    monkeypatch.setattr(Picture, "read", noted)
    assert doubt_calibration(capture) is None
    assert len(read) == 6 + count  # all three pairs are read to compare their pixels


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


def test_a_camera_with_the_images_of_the_other_is_named(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair().write(tmp_path / "pair")
    capture = open_capture(folder)
    assert doubt_calibration(capture) is None
    a, b = capture.cameras
    doubt = doubt_calibration(replace(capture, cameras=(a, replace(b, pictures=a.pictures))))
    assert doubt is not None
    assert doubt.startswith("the images of left and right are the same to the last pixel")
    shutil.rmtree(folder / "right")
    shutil.copytree(folder / "left", folder / "right")
    check_refused(
        servoid_command, tmp_path, r"the images of left/0000 and right/0000 are the same to the",
        "model", folder, "--out", tmp_path / "body.json",
    )  # fmt: skip


@pytest.mark.parametrize("later", [1, 2])
def test_a_camera_that_later_has_the_images_of_the_other_is_named(
    later: int, tmp_path: Path
) -> None:
    capture = write_pair(tmp_path, Pose.exp(RIGS["other right of one"]).matrix())
    a, b = capture.cameras
    pictures = (*b.pictures[:later], *a.pictures[later:])
    doubt = doubt_calibration(replace(capture, cameras=(a, replace(b, pictures=pictures))))
    assert doubt is not None
    assert doubt.startswith(f"in observation {later}, the images of one and other are the same")


@pytest.mark.extended
@pytest.mark.parametrize("name", PAIRS)
def test_recorded_pairs_are_exchanged_only_if_they_are(name: str) -> None:
    if not (DATA / "stereo" / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(DATA / "stereo" / name)
    assert doubt_calibration(capture) is None
    assert "are exchanged" in str(doubt_calibration(with_exchanged_images(capture)))


@pytest.mark.parametrize("name", ["other right of one", "other above one"])
def test_a_rig_with_a_turned_camera_is_doubted_whatever_the_rig(name: str, tmp_path: Path) -> None:
    capture = write_pair(tmp_path, Pose.exp(RIGS[name]).matrix())
    a, b = capture.cameras
    turn = [0.0, 0.25, 0.0] if name == "other right of one" else [0.25, 0.0, 0.0]
    for sign in (1.0, -1.0):
        pose = b.rig_from_camera @ Pose.exp([0.0, 0.0, 0.0, *(sign * each for each in turn)])
        wrong = replace(capture, cameras=(a, replace(b, rig_from_camera=pose)))
        doubt = doubt_calibration(wrong)
        assert doubt is not None and "the images contradict the " in doubt


def turned(capture: Capture, degrees: float) -> Capture:
    """Give the right camera of a pair a pose that is turned about its vertical axis."""
    a, b = capture.cameras
    turn = Pose.exp([0.0, 0.0, 0.0, 0.0, float(np.radians(degrees)), 0.0])
    return replace(capture, cameras=(a, replace(b, rig_from_camera=b.rig_from_camera @ turn)))


@pytest.mark.parametrize("degrees", [12.0, 20.0])
def test_a_pair_that_sees_all_behind_its_cameras_is_doubted_and_not_modelled(
    degrees: float, tmp_path: Path
) -> None:
    capture = turned(open_capture(Pair().write(tmp_path / "pair")), degrees)
    doubt = doubt_calibration(capture)
    assert doubt is not None and doubt.startswith("the images contradict the ")
    with pytest.raises(CameraError, match="the images contradict the calibration of left/0000"):
        fit_capture(capture, Request(max_ellipsoids=1))


@pytest.mark.extended
@pytest.mark.parametrize("degrees", [-6.0, -2.0, 2.0, 6.0])
@pytest.mark.parametrize("name", RECORDED)
def test_a_camera_of_a_recorded_pair_that_is_turned_is_doubted(name: str, degrees: float) -> None:
    if not (DATA / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(DATA / name)
    assert doubt_calibration(capture) is None
    doubt = doubt_calibration(turned(capture, degrees))
    assert doubt is not None and "the images contradict the " in doubt

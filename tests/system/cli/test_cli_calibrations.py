"""Calibrations by other programs on the command line: poses as with the capture's own."""

import re
from pathlib import Path

import numpy as np
import pytest
from drawn_pairs import BASELINE, CENTER_PX, FOCAL_PX, SIZE_PX, Pair
from tool_calibrations import (
    kalibr,
    opencv_lenses,
    opencv_poses,
    write,
    write_opencv,
    write_ros_pair,
)

from conftest import Command
from servoid.camera import Lens
from servoid.pose import Pose
from servoid.record import read_trajectory

MOVING = Pair(centers=tuple((0.012 + 0.004 * i, -0.008, 0.42) for i in range(4)))
EYE = Lens(model="pinhole", size_px=SIZE_PX, focal_px=(FOCAL_PX,) * 2, center_px=CENTER_PX)
RIGHT_FROM_LEFT = Pose.exp([-BASELINE, 0.0, 0.0, 0.0, 0.0, 0.0])
CALIBRATED = re.compile(r"^(model|focal_px|center_px|distortion|rig_from_camera) = .*\n", re.M)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a capture, and beside it the same one without its calibration."""
    folder = tmp_path_factory.mktemp("calibrations")
    MOVING.write(folder / "own", rate_hz=10.0)
    bare = MOVING.write(folder / "bare", rate_hz=10.0) / "capture.toml"
    bare.write_text(CALIBRATED.sub("", bare.read_text()))
    return folder


def write_calibration(tool: str, folder: Path) -> Path:
    if tool == "Kalibr":
        return write(folder / "camchain.yaml", kalibr([EYE, EYE], [RIGHT_FROM_LEFT]))
    if tool == "ROS":
        write_ros_pair(folder, EYE, EYE, RIGHT_FROM_LEFT)
        return folder
    write_opencv(folder / "intrinsics.yml", opencv_lenses(EYE, EYE))
    write_opencv(folder / "extrinsics.yml", opencv_poses(RIGHT_FROM_LEFT))
    return Path(f"{folder / 'intrinsics.yml'}+{folder / 'extrinsics.yml'}")


@pytest.mark.parametrize(
    "tool",
    [
        "Kalibr",
        pytest.param("ROS", marks=pytest.mark.extended),
        pytest.param("OpenCV", marks=pytest.mark.extended),
    ],
)
def test_a_track_with_a_calibration_by_a_tool_has_the_poses_of_the_captures_own(
    tool: str, drawn: Path, tmp_path: Path, servoid_command: Command
) -> None:
    own = servoid_command("track", drawn / "own", "--out", tmp_path / "own.csv")
    assert own.code == 0, own.err
    path = write_calibration(tool, tmp_path)
    done = servoid_command(
        "track", drawn / "bare", "--calibration", path, "--out", tmp_path / "tool.csv"
    )
    assert done.code == 0, done.err
    assert ("if its T is in metres" in " ".join(done.out.split())) == (tool == "OpenCV")
    for one, other in zip(
        *(read_trajectory(tmp_path / name) for name in ("own.csv", "tool.csv")), strict=True
    ):
        assert one.status == other.status == "tracking"
        off = one.world_from_object.matrix() - other.world_from_object.matrix()
        assert np.abs(off).max() < 1e-6


def test_a_calibration_of_two_files_is_not_written_over(
    drawn: Path, tmp_path: Path, servoid_command: Command
) -> None:
    write_ros_pair(tmp_path, EYE, EYE, RIGHT_FROM_LEFT)
    second = (tmp_path / "right.yaml").rename(tmp_path / "right.txt")
    before, both = second.read_text(), f"{tmp_path / 'left.yaml'}+{second}"
    ended = servoid_command("track", drawn / "bare", "--calibration", both, "--out", second)
    assert ended.code == 2 and "right.txt is an input; give --out another" in ended.err
    assert second.read_text() == before


def test_a_scan_does_not_replace_the_folder_of_its_calibration(
    drawn: Path, tmp_path: Path, servoid_command: Command
) -> None:
    write_ros_pair(tmp_path, EYE, EYE, RIGHT_FROM_LEFT)
    left = tmp_path / "left.yaml"
    ended = servoid_command("scan", drawn / "bare", "--calibration", left, "--out", tmp_path)
    assert ended.code == 2 and "is replaced as a whole" in " ".join(ended.err.split())
    assert left.exists()


def test_the_help_names_the_tools_whose_calibrations_are_read(servoid_command: Command) -> None:
    for command in ("track", "model", "scan"):
        shown = " ".join(servoid_command(command, "--help").out.replace("│", " ").split())
        assert "by Kalibr, ROS or OpenCV" in shown

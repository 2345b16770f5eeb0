"""Calibrations by Kalibr, ROS and OpenCV: each lens against OpenCV, each pose against the rig's."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from tool_calibrations import (
    LENSES,
    RIGHT_FROM_LEFT,
    SIZE_PX,
    distortion_of,
    kalibr,
    lens,
    matrix_of,
    opencv_lenses,
    opencv_poses,
    rectified,
    ros,
    write,
    write_opencv,
    write_ros_pair,
)

from servoid.camera import Lens
from servoid.exchange import ToolCalibration, calibration_files, read_tool_calibration
from servoid.pose import Pose

KALIBRS = [name for name in LENSES if name not in ("five numbers", "eight numbers")]
SHIFTED = lens("brown_conrady", (-0.19, 0.05, -0.001, 0.001, -0.02), 530.0)


def read(path: Path, sizes_px: Sequence[tuple[int, int]] | None = None) -> ToolCalibration:
    found = read_tool_calibration(calibration_files(path), sizes_px)
    assert found is not None
    return found


def check_projects(mine: Lens, true: Lens) -> None:
    """Check that a lens projects points as OpenCV does with the true numbers."""
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(-0.5, 0.5, (50, 2)), rng.uniform(0.9, 1.5, 50)])
    k, none = matrix_of(true), np.zeros(3)
    if true.model == "kannala_brandt":
        d = np.array(true.distortion)
        expected = cv2.fisheye.projectPoints(points[None], none, none, k, d)[0][0]
    else:
        expected = cv2.projectPoints(points, none, none, k, distortion_of(true))[0][:, 0]
    assert np.abs(mine.project(points) - expected).max() < 1e-9


def write_one(tool: str, folder: Path, name: str) -> Path:
    one = LENSES[name]
    if tool == "Kalibr":
        return write(folder / "camchain.yaml", kalibr([one]))
    if tool == "ROS":
        return write(folder / "ost.yaml", ros(one))
    sample = {
        "image_width": SIZE_PX[0],
        "image_height": SIZE_PX[1],
        "flags": 0,
        "fisheye_model": int(one.model == "kannala_brandt"),
        "camera_matrix": matrix_of(one),
        "distortion_coefficients": distortion_of(one)[:, None],
        "avg_reprojection_error": np.array([[0.31]]),
    }
    return write_opencv(folder / f"camera.{'json' if tool == 'OpenCV in JSON' else 'yml'}", sample)


CASES = [
    (tool, name)
    for tool in ("Kalibr", "ROS", "OpenCV", "OpenCV in JSON")
    for name in (KALIBRS if tool == "Kalibr" else LENSES)
]


@pytest.mark.parametrize(("tool", "name"), CASES)
def test_each_lens_of_each_tool_projects_as_opencv_does(
    tool: str, name: str, tmp_path: Path
) -> None:
    found = read(write_one(tool, tmp_path, name))
    (camera,) = found.cameras
    assert camera.lens.size_px == SIZE_PX and camera.rig_from_camera == Pose.identity()
    assert camera.lens.model == LENSES[name].model and found.notes == ()
    check_projects(camera.lens, LENSES[name])


def test_a_chain_of_kalibr_gives_each_camera_its_pose_on_the_rig(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    rig_from_camera = [Pose.identity(), *(Pose.exp(one) for one in rng.normal(0, 0.3, (3, 6)))]
    steps = [rig_from_camera[n].inverse() @ rig_from_camera[n - 1] for n in (1, 2, 3)]
    lenses = [LENSES[name] for name in ("four numbers", "fisheye", "pinhole", "four numbers")]
    found = read(write(tmp_path / "camchain.yaml", kalibr(lenses, steps)))
    assert [camera.name for camera in found.cameras] == ["cam0", "cam1", "cam2", "cam3"]
    for camera, one, pose in zip(found.cameras, lenses, rig_from_camera, strict=True):
        assert np.abs(camera.rig_from_camera.matrix() - pose.matrix()).max() < 1e-12
        check_projects(camera.lens, one)
    point = np.array([[0.1, -0.2, 1.5]])
    in_cam0, in_cam1 = (
        camera.rig_from_camera.inverse().transform(point) for camera in found.cameras[:2]
    )
    assert np.abs(steps[0].transform(in_cam0) - in_cam1).max() < 1e-12


@pytest.mark.parametrize(
    ("topics", "names"),
    [
        (("/rig/right/image_raw", "/rig/left/image_raw/compressed"), ["right", "left"]),
        (("/a/eye/image", "/b/eye/image"), ["a_eye", "b_eye"]),
        (("/eye/a", "/eye/b"), ["cam0", "cam1"]),
        (("", ""), ["cam0", "cam1"]),
        (("/.a/image", "/b/image"), ["cam0", "cam1"]),
    ],
)
def test_cameras_of_kalibr_are_named_as_those_of_a_bag_with_their_topics(
    topics: tuple[str, str], names: list[str], tmp_path: Path
) -> None:
    chain = kalibr([LENSES["pinhole"]] * 2, [RIGHT_FROM_LEFT], topics)
    found = read(write(tmp_path / "camchain.yaml", chain))
    assert [camera.name for camera in found.cameras] == names


PAIRS = {
    "five numbers": (LENSES["five numbers"], SHIFTED),
    "eight numbers": (LENSES["eight numbers"], LENSES["eight numbers"]),
    "pinhole": (LENSES["pinhole"], lens("pinhole", (), 500.0)),
    "fisheye": (LENSES["fisheye"], lens("kannala_brandt", (0.01, 0.002, 0.0, 0.001), 310.0)),
}


@pytest.mark.parametrize("name", PAIRS)
def test_a_pair_that_opencv_rectified_has_its_pose_from_the_files_of_ros(
    name: str, tmp_path: Path
) -> None:
    left, right = PAIRS[name]
    both = write_ros_pair(tmp_path, left, right, RIGHT_FROM_LEFT)
    for path in (tmp_path, both):
        found = read(path)
        assert [camera.name for camera in found.cameras] == ["left", "right"]
        off = found.cameras[1].rig_from_camera @ RIGHT_FROM_LEFT
        assert np.abs(off.log()).max() < 1e-9
        for camera, one in zip(found.cameras, (left, right), strict=True):
            check_projects(camera.lens, one)
    turned = read(Path(f"{tmp_path}/right.yaml+{tmp_path}/left.yaml"))
    assert [camera.name for camera in turned.cameras] == ["right", "left"]
    off = turned.cameras[1].rig_from_camera.inverse() @ RIGHT_FROM_LEFT
    assert np.abs(off.log()).max() < 1e-9


def test_a_pair_rounded_as_ros_writes_it_is_within_its_rounding(tmp_path: Path) -> None:
    write_ros_pair(tmp_path, *PAIRS["five numbers"], RIGHT_FROM_LEFT)
    for name in ("left.yaml", "right.yaml"):
        content = yaml.safe_load((tmp_path / name).read_text())
        for key in ("camera_matrix", "projection_matrix", "rectification_matrix"):
            places = 8 if key == "rectification_matrix" else 5
            content[key]["data"] = [round(one, places) for one in content[key]["data"]]
        write(tmp_path / name, content)
    found = read(tmp_path)
    off = found.cameras[1].rig_from_camera @ RIGHT_FROM_LEFT
    assert 1e-10 < np.abs(off.log()).max() < 1e-6


def test_cameras_of_ros_have_the_last_part_of_their_names_or_those_of_their_files(
    tmp_path: Path,
) -> None:
    of_left, of_right = rectified(*PAIRS["five numbers"], RIGHT_FROM_LEFT)
    for names, expected in (
        (("stereo/left", "stereo/right"), ["left", "right"]),
        (("stereo", "stereo"), ["a", "b"]),
        ((7, 8), ["7", "8"]),
        ((None, ".."), ["a", "b"]),
    ):
        for file, name, seen in zip("ab", names, (of_left, of_right), strict=True):
            content = ros(LENSES["five numbers"], "", seen) | {"camera_name": name}
            write(tmp_path / f"{file}.yaml", content)
        found = read(Path(f"{tmp_path}/a.yaml+{tmp_path}/b.yaml"))
        assert [camera.name for camera in found.cameras] == expected


@pytest.mark.parametrize("ending", ["yml", "json"])
def test_a_pair_that_opencv_calibrated_is_read_from_two_files_or_from_one(
    ending: str, tmp_path: Path
) -> None:
    left, right = PAIRS["five numbers"]
    lenses, poses = opencv_lenses(left, right), opencv_poses(RIGHT_FROM_LEFT)
    write_opencv(tmp_path / f"intrinsics.{ending}", lenses)
    write_opencv(tmp_path / f"extrinsics.{ending}", poses)
    write_opencv(tmp_path / f"both.{ending}", lenses | poses)
    for name in (f"intrinsics.{ending}+{tmp_path}/extrinsics.{ending}", f"both.{ending}"):
        found = read(tmp_path / name, [SIZE_PX, SIZE_PX])
        off = found.cameras[1].rig_from_camera @ RIGHT_FROM_LEFT
        assert np.abs(off.log()).max() < 1e-12
        for camera, one in zip(found.cameras, (left, right), strict=True):
            check_projects(camera.lens, one)
        size, apart = found.notes
        files = str(found.notes[1]).removeprefix("the cameras of ").split(" are ")[0]
        assert size == f"there is no size of images in {files}; 640x480 pixels are taken"
        assert apart.endswith("apart, if its T is in metres") and " 120.2 mm " in apart


def test_fourteen_numbers_of_opencv_are_read_if_the_last_are_zero(tmp_path: Path) -> None:
    left, right = PAIRS["eight numbers"]
    content = opencv_lenses(left, right) | opencv_poses(RIGHT_FROM_LEFT)
    content |= {key: np.hstack([content[key], np.zeros((1, 6))]) for key in ("D1", "D2")}
    found = read(write_opencv(tmp_path / "both.yml", content), [SIZE_PX])
    check_projects(found.cameras[0].lens, left)

"""What is surely wrong from the start on keeps all poses from being trusted."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from trust_scenes import SMALL, write_course, write_depth_course

from servoid import model, track
from servoid.camera import Camera, Lens, pinhole_lens, wrong_size
from servoid.capture import Capture
from servoid.exchange import open_any
from servoid.pose import Pose
from servoid.track import TrackResult, track_capture

DRILL = 2
QUICK = model.Request(max_ellipsoids=1, delta=0.0)
SIZE_PX = (320, 240)


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    return write_depth_course(tmp_path / "drill", "turn", DRILL, SMALL, 4)


def held(result: TrackResult, words: str) -> bool:
    """Return whether no pose is trusted, and each says why."""
    told = [one for one in result.tracked if any(words in notice for notice in one.notices)]
    assert result.wrong_by is None or len(told) == len(result)
    return {one.estimate.status for one in told} == {"searching"} and not any(
        one.estimate.confidence for one in told
    )


def widened(folder: Path, by_px: int) -> Capture:
    path = folder / "masks" / "0000.png"
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    assert cv2.imwrite(str(path), cv2.dilate(mask, np.ones((2 * by_px + 1,) * 2, np.uint8)))
    return open_any(folder)


def test_a_mask_with_much_of_the_wall_behind_holds_all_poses(drawn: Path) -> None:
    (result,) = track_capture(widened(drawn, 16))
    assert result.wrong_by is not None
    assert held(result, result.wrong_by)


def test_a_mask_that_is_a_little_wide_holds_none(drawn: Path) -> None:
    (result,) = track_capture(widened(drawn, 2))
    assert result.wrong_by is None
    assert result.tracked_count == len(result)


@pytest.mark.parametrize("distortion", [(), (-0.2, 0.05, 0.0, 0.0), (0.1, 0.0, 0.0, 0.0)])
def test_a_mask_that_is_inverted_holds_all_poses(
    distortion: tuple[float, ...], drawn: Path
) -> None:
    path = drawn / "masks" / "0000.png"
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    assert cv2.imwrite(str(path), np.asarray(255 - mask, np.uint8))
    capture = open_any(drawn)
    (camera,) = capture.cameras
    lens = camera.lens
    lens = Lens(
        model="brown_conrady" if distortion else "pinhole",
        size_px=lens.size_px,
        focal_px=lens.focal_px,
        center_px=lens.center_px,
        distortion=distortion,
    )
    (result,) = track_capture(replace(capture, cameras=(replace(camera, lens=lens),)))
    assert held(result, "the mask holds the border of the image all around")
    assert any("are black and white swapped?" in doubt for doubt in result.doubts)


def test_a_hole_in_the_object_is_no_second_surface_that_is_surely_wrong(drawn: Path) -> None:
    mask = cv2.imread(str(drawn / "masks" / "0000.png"), cv2.IMREAD_GRAYSCALE)
    path = drawn / "depth" / "0000.png"
    depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert depth is not None and mask is not None
    far = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
    hole = far > np.quantile(far[mask != 0], 0.75)
    depth[hole] = 15_000
    assert cv2.imwrite(str(path), depth)
    assert model.fit_capture(open_any(drawn), QUICK, observations=slice(0, 1)).wrong_by is None


def test_what_is_measured_a_hundred_metres_away_is_not_trusted(drawn: Path) -> None:
    toml = drawn / "capture.toml"
    toml.write_text(toml.read_text().replace("depth_scale_m = 0.0001", "depth_scale_m = 0.1"))
    (result,) = track_capture(open_any(drawn))
    assert held(result, "measured more than 100 m away")
    assert any("in millimetres" in doubt for doubt in result.doubts)


def test_what_a_depth_camera_measures_farther_than_it_sees_is_doubted(drawn: Path) -> None:
    toml = drawn / "capture.toml"
    toml.write_text(toml.read_text().replace("depth_scale_m = 0.0001", "depth_scale_m = 0.00254"))
    made = model.fit_capture(open_any(drawn), QUICK, observations=slice(0, 1))
    assert any("or inches" in doubt for doubt in made.all_doubts)
    assert made.wrong_by is None


def test_the_calibration_of_images_twice_as_large_holds_all_poses(tmp_path: Path) -> None:
    folder = write_course(tmp_path / "drill", "turn", DRILL, SMALL)
    capture = open_any(folder)
    wrong = tuple(
        replace(one, lens=lens_of_larger_images(one.lens.focal_px[0] * 2.0))
        for one in capture.cameras
    )
    request = track.Request(observations=slice(0, 4))
    (result,) = track_capture(replace(capture, cameras=wrong), request=request)
    assert held(result, "is that of images 2 times as large")


@pytest.mark.parametrize(
    ("unit", "is_held"), [(1.0, False), (2.0, False), (50.0, True), (0.01, True)]
)
def test_cameras_that_are_metres_or_less_than_a_millimetre_apart_are_not_believed(
    unit: float, is_held: bool, tmp_path: Path
) -> None:
    capture = open_any(write_course(tmp_path / "drill", "turn", DRILL, SMALL))
    left, right = capture.cameras
    seat = Pose.from_parts(
        unit * np.array(right.rig_from_camera.translation), right.rig_from_camera.quaternion
    )
    wrong = replace(capture, cameras=(left, replace(right, rig_from_camera=seat)))
    made = model.fit_capture(wrong, QUICK, observations=slice(0, 1))
    assert (made.wrong_by is not None and "not in metres" in made.wrong_by) == is_held


def lens_of_larger_images(focal_px: float) -> Lens:
    return pinhole_lens(
        Camera(size_px=SIZE_PX, focal_px=(focal_px, focal_px), center_px=(319.5, 239.5))
    )


@pytest.mark.parametrize(
    ("center_px", "is_wrong"),
    [
        ((159.5, 119.5), False),
        ((319.5, 239.5), True),
        ((479.5, 359.5), True),
        ((319.5, 119.5), False),  # the left half of an image
        ((239.5, 182.0), True),
        ((79.5, 58.0), True),  # of smaller ones
        ((250.0, 165.0), False),
        ((79.5, 119.5), False),
        ((400.0, 220.0), False),  # a part of one
        ((0.5, 0.5), False),
    ],
)
def test_only_a_middle_far_along_the_diagonal_is_surely_of_images_of_another_size(
    center_px: tuple[float, float], is_wrong: bool
) -> None:
    camera = Camera(size_px=SIZE_PX, focal_px=(300.0, 300.0), center_px=center_px)
    assert (wrong_size("camera left", camera) is not None) == is_wrong

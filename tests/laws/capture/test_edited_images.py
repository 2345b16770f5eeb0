"""Images that are shifted or enlarged after they were taken are told from cameras that move."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_tracker import plain_body
from numpy.typing import NDArray
from recordings import Recording
from turned_cameras import Image, changed

from servoid.capture import Capture, CaptureCamera, doubt_edited, open_capture
from servoid.pose import Pose
from servoid.track import Subject, track_capture

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
COUNT = 5
Edit = Callable[[Image, float, float], Image]
"""Changes an image, by a share from 0 to 1 of the whole change, and the focal length in pixels."""


def warped(image: Image, matrix: NDArray[np.float64]) -> Image:
    height, width = image.shape[:2]
    return np.asarray(cv2.warpPerspective(image, matrix, (width, height)), np.uint8)


def stabilised(image: Image, share: float, _: float) -> Image:
    by = 0.12 * share * image.shape[1]
    return warped(image, np.array([[1.0, 0.0, by], [0.0, 1.0, -0.5 * by], [0.0, 0.0, 1.0]]))


def zoomed(image: Image, share: float, _: float) -> Image:
    times, (height, width) = 1.0 + 0.3 * share, image.shape[:2]
    x, y = 0.5 * (1.0 - times) * (width - 1), 0.5 * (1.0 - times) * (height - 1)
    return warped(image, np.array([[times, 0.0, x], [0.0, times, y], [0.0, 0.0, 1.0]]))


def turned(
    image: Image, share: float, focal_px: float, axis: int = 4, degrees: float = 3.0
) -> Image:
    height, width = image.shape[:2]
    matrix = np.array(
        [[focal_px, 0.0, (width - 1) / 2], [0.0, focal_px, (height - 1) / 2], [0.0, 0.0, 1.0]]
    )
    twist = np.zeros(6)
    twist[axis] = np.radians(degrees * share)
    return warped(image, matrix @ Pose.exp(twist).matrix()[:3, :3] @ np.linalg.inv(matrix))


def rolled(image: Image, share: float, focal_px: float) -> Image:
    return turned(image, share, focal_px, axis=5, degrees=8.0)


def edited(capture: Capture, edit: Edit, step: int = 1) -> Capture:
    """Return every `step`-th observation, of which each camera's image is edited more."""

    def more(image: Image, camera: CaptureCamera, number: int) -> Image:
        return edit(image, number / (COUNT - 1), camera.lens.focal_px[0])

    return changed(capture, COUNT, more, step)


@pytest.fixture(scope="module")
def still(recording: Callable[[str], Recording]) -> Capture:
    return recording("colour").capture


@pytest.mark.parametrize("edit", [stabilised, zoomed])
def test_images_that_are_moved_as_a_whole_are_told(edit: Edit, still: Capture) -> None:
    doubt = doubt_edited(edited(still, edit))
    assert doubt is not None
    assert "were shifted or enlarged after they were taken" in doubt
    assert "near ones as far ones, which no motion of the cameras does" in doubt
    assert ("1.30 times as large" in doubt) == (edit is zoomed)


@pytest.mark.parametrize("edit", [lambda image, *_: image, turned, rolled])
def test_cameras_that_rest_or_turn_are_not_taken_for_edited(edit: Edit, still: Capture) -> None:
    assert doubt_edited(edited(still, edit)) is None


def test_cameras_that_move_without_poses_are_not_taken_for_edited(
    recording: Callable[[str], Recording],
) -> None:
    moving = recording("long hand").capture
    resting = replace(moving, world_from_rig=(Pose.identity(),) * len(moving))
    for first in range(0, len(moving) - 4, 3):
        assert doubt_edited(resting, among=range(first, first + 5)) is None
    assert doubt_edited(resting) is None


def test_of_images_that_were_edited_no_pose_is_confirmed(still: Capture) -> None:
    wrong = edited(still, stabilised)
    start = Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    [track] = track_capture(wrong, [Subject(body=plain_body(start), start=start)])
    assert track.edit_doubt is not None and track.capture_doubts == (track.edit_doubt,)
    assert (track.tracked_count, track.verdict) == (0, "poor")
    assert "the images were changed after they were taken" in track.reasons
    assert all(one.estimate.confidence == 0.0 for one in track.tracked)


@pytest.mark.extended
@pytest.mark.parametrize("name", ["stereo/mustard", "stereo/drill", "hard/mug_sway"])
def test_recorded_cameras_are_told_only_if_their_images_are_edited(name: str) -> None:
    if not (DATA / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(DATA / name)
    assert doubt_edited(capture) is None
    for edit in (stabilised, zoomed):
        assert doubt_edited(edited(capture, edit, step=8)) is not None
    for edit in (turned, rolled):
        assert doubt_edited(edited(capture, edit, step=8)) is None

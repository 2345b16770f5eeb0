"""A camera that is moved during a recording contradicts the calibration at its end."""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest
from fake_tracker import plain_body
from recordings import Recording
from turned_cameras import turned

from servoid.capture import Capture, PosedImage, capture_of, doubt_calibration, is_refuted
from servoid.capture.exchanged import Sides
from servoid.pose import Pose
from servoid.track import Request, Subject, track_capture

COUNT = 12


@pytest.fixture(scope="module")
def still(recording: Callable[[str], Recording]) -> Capture:
    return recording("colour").capture


def loosened(capture: Capture, degrees: float) -> Capture:
    """Let the right camera turn slowly, by an angle at the end."""
    views = {(view.camera_name, view.index): view for view in capture.all_views()}
    observations = []
    for index in range(COUNT):
        seen = []
        for name in ("left", "right"):
            view = views[name, index]
            by = degrees * index / (COUNT - 1) if name == "right" else 0.0
            image = turned(view.image(), by, view.camera.focal_px[0], cv2.BORDER_REFLECT)
            mask = view.mask() if view.has_mask else None
            seen.append(
                PosedImage(
                    camera=view.camera,
                    world_from_camera=view.world_from_camera,
                    image=image,
                    mask=mask,
                )
            )
        observations.append(seen)
    return capture_of(observations, rate_hz=30.0)


@pytest.mark.parametrize("degrees", [-2.5, 2.5])
def test_a_camera_that_turns_slowly_is_told(degrees: float, still: Capture) -> None:
    assert doubt_calibration(loosened(still, 0.0)) is None
    doubt = doubt_calibration(loosened(still, degrees))
    assert doubt is not None and doubt.startswith("a camera was moved meanwhile")


def test_a_lens_that_is_wrong_throughout_was_not_moved_meanwhile() -> None:
    at_end = Sides(matched=488, front=439, behind=1, off=48)
    assert at_end.contradict
    assert not at_end.is_worse(Sides(matched=900, front=830, off=70))
    assert at_end.is_worse(Sides(matched=900, front=880, off=20))
    assert not at_end.is_worse(Sides()), "of a start where nothing matches, nothing is known"


@pytest.mark.extended
def test_a_track_in_python_is_compared_with_calibration_and_rig_too(still: Capture) -> None:
    [right] = track_capture(still, request=Request(observations=slice(COUNT)))
    assert (right.calibration_doubt, right.rig_doubt) == (None, None)
    assert right.verdict == "good"
    known = Subject(body=right.body, start=right.estimates[0].world_from_object)
    [wrong] = track_capture(loosened(still, 2.5), [known])
    assert wrong.calibration_doubt is not None and wrong.verdict != "good"
    assert "the calibration is in doubt" in wrong.reasons


def test_a_track_in_python_of_a_rig_with_inverted_poses_is_not_good(
    recording: Callable[[str], Recording],
) -> None:
    capture = recording("long hand").capture
    poses = tuple(pose.inverse() for pose in capture.world_from_rig)
    start = poses[0] @ Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    known = Subject(body=plain_body(start), start=start)
    [wrong] = track_capture(replace(capture, world_from_rig=poses), [known])
    assert wrong.rig_doubt is not None and "invert them" in wrong.rig_doubt
    assert "the poses of the rig are in doubt" in wrong.reasons
    assert wrong.verdict != "good"


def right_turned(capture: Capture, degrees: float) -> Capture:
    """Give the right camera a wrong pitch in the calibration."""
    left, right = capture.cameras
    turn = Pose.exp([0.0, 0.0, 0.0, np.radians(degrees), 0.0, 0.0])
    return replace(
        capture, cameras=(left, replace(right, rig_from_camera=right.rig_from_camera @ turn))
    )


@pytest.mark.parametrize(("degrees", "is_wrong"), [(0.0, False), (0.05, False), (6.0, True)])
def test_a_calibration_that_most_features_contradict_is_surely_wrong(
    degrees: float, is_wrong: bool, still: Capture
) -> None:
    assert is_refuted(right_turned(still, degrees)) == is_wrong


@pytest.mark.extended
def test_no_pose_is_confirmed_beside_a_calibration_that_is_surely_wrong(still: Capture) -> None:
    [right] = track_capture(still, request=Request(observations=slice(COUNT)))
    known = Subject(body=right.body, start=right.estimates[0].world_from_object)
    for degrees in (0.05, 6.0):
        [track] = track_capture(right_turned(still, degrees), [known])
        is_surely_wrong = degrees > 1.0
        assert (track.calibration_doubt is not None) == is_surely_wrong
        assert (not any(one.estimate.confidence for one in track.tracked)) == is_surely_wrong

"""A tracker refuses calls that it cannot take by an error of servoid."""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from fake_tracker import plain_body

from servoid.camera import Camera
from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.shape import load_body, save_body
from servoid.track import Tracker

IMAGE = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
FAR = Pose.from_parts([0.0, 0.0, 0.6], [1.0, 0.0, 0.0, 0.0])


@pytest.fixture
def tracker() -> Tracker:
    started = Tracker(Camera.from_fov((160, 120), 60.0), plain_body())
    started.start(0.0, Pose.identity(), IMAGE, FAR)
    return started


@pytest.mark.parametrize("given", [-1, 2**80])
@pytest.mark.parametrize("name", ["resolution", "threads"])
def test_terms_are_scored_at_whole_numbers_from_zero(
    name: str, given: int, tracker: Tracker
) -> None:
    poses = [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.6]]
    with pytest.raises(TrackError, match=f"{name} must be a whole number.*{given} was given"):
        tracker.score_terms(0.1, Pose.identity(), IMAGE, poses, **{name: given})


@pytest.mark.parametrize("given", [-1, 2**80])
def test_keyframes_are_numbered_from_zero(given: int, tracker: Tracker) -> None:
    with pytest.raises(TrackError, match=f"number must be a whole number.*{given} was given"):
        tracker.keyframe_pose(given)


def test_a_file_without_an_appearance_has_none_to_recall(tmp_path: Path, tracker: Tracker) -> None:
    save_body(tmp_path / "body.json", plain_body())
    with pytest.raises(TrackError, match="saved without one; start the tracker at a pose"):
        tracker.recall(load_body(tmp_path / "body.json").look())


def test_a_tracker_takes_one_call_at_a_time_and_says_so(tracker: Tracker) -> None:
    poses = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.6], (20_000, 1))
    scoring = Thread(target=tracker.score_terms, args=(0.1, Pose.identity(), IMAGE, poses))
    scoring.start()
    refused = 0
    while scoring.is_alive() and not refused:
        assert tracker.body == tracker.body
        try:
            tracker.step(0.1, Pose.identity(), IMAGE)
        except TrackError as error:
            refused += "another thread is calling this tracker" in str(error)
    scoring.join()
    assert refused
    tracker.step(0.2, Pose.identity(), IMAGE)


def test_a_mask_that_lies_elsewhere_than_the_given_pose_is_reported_and_not_trusted() -> None:
    tracker = Tracker(Camera.from_fov((160, 120), 60.0), plain_body())
    mask = np.zeros((120, 160), np.uint8)
    mask[:30, :30] = 255
    found = tracker.start(0.0, Pose.identity(), IMAGE, FAR, [mask])
    (notice,) = (one for one in found.notices if "mask" in one)
    assert notice.startswith("camera 0: only 0 % of the mask is where the object is")
    assert (found.status, found.located) == ("searching", False)
    assert found.confidence < 0.5

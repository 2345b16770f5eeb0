"""A tracker refuses calls that it cannot take by an error of servoid."""

from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

import cv2
import numpy as np
import pytest
from fake_tracker import plain_body
from numpy.typing import NDArray

from servoid._native import taken_depth, taken_image, taken_mask
from servoid.camera import Camera
from servoid.errors import ImageError, MaskError, TrackError
from servoid.pose import Pose
from servoid.shape import load_body, save_body
from servoid.track import Tracker

IMAGE = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
DISC = cv2.circle(IMAGE // 4, (80, 60), 9, (250, 20, 40), cv2.FILLED)
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


@pytest.mark.parametrize(
    ("image", "cure"),
    [
        (np.zeros((3, 8, 9), np.uint8), r"move its first axis to the end: image\.transpose"),
        (np.zeros((1, 8, 9), np.uint8), r"leave its first axis out: image\[0\]"),
        (np.zeros((8, 9, 4), np.uint8), r"leave its transparency out: image\[\.\.\., :3\]"),
        (np.zeros((8, 9), np.int8), r"of int8 was given; .*image\.view\(numpy\.uint8\) if"),
        (np.zeros((8, 9), object), r"of object was given; make an array of numbers of it"),
        (np.zeros((8, 9), np.complex64), r"of complex64 was given; make an array of numbers"),
        (np.zeros((8, 9, 2), np.uint8), r"\(8, 9, 2\) of uint8 was given; give one image for"),
    ],
)
def test_an_image_of_another_shape_or_type_is_refused_with_how_to_convert_it(
    image: NDArray[Any], cure: str, tracker: Tracker
) -> None:
    with pytest.raises(ImageError, match=rf"must be \(H, W\) or \(H, W, 3\) of uint8.*{cure}"):
        tracker.find(0.0, [Pose.identity()], [image])


@pytest.mark.parametrize(
    ("take", "kind", "error"),
    [
        (taken_image, np.uint8, ImageError),
        (taken_mask, np.uint8, MaskError),
        (taken_depth, np.float32, ImageError),
    ],
)
def test_an_array_with_masked_values_is_refused(
    take: Callable[[Any], object], kind: type, error: type[Exception]
) -> None:
    values = np.zeros((8, 9), kind)
    take(values)
    with pytest.raises(error, match=r"an array \(8, 9\) of \w+ with masked values .* filled\(0\)"):
        take(np.ma.masked_array(values, mask=False))


@pytest.mark.parametrize(
    ("taught", "shown", "words"),
    [
        (DISC, DISC[..., 0], "was learned in images in colour, and these images are grey"),
        (DISC[..., 0], DISC, "was learned in grey images, and these images are in colour"),
    ],
    ids=["colour", "grey"],
)
def test_a_look_that_was_learned_in_images_of_another_kind_says_in_which(
    taught: NDArray[np.uint8], shown: NDArray[np.uint8], words: str
) -> None:
    camera = Camera.from_fov((160, 120), 60.0)
    teacher, other = (Tracker(camera, plain_body()) for _ in range(2))
    mask = DISC[..., 0] > 100
    teacher.start(0.0, Pose.identity(), np.ascontiguousarray(taught), FAR, mask)
    other.recall(teacher.appearance())
    with pytest.raises(TrackError, match=words):
        other.find(0.0, Pose.identity(), np.ascontiguousarray(shown))

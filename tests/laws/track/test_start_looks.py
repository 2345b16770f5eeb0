"""A start that nothing but its numbers supports is not believed against what a body looks like."""

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import cv2
import numpy as np
import pytest
from recordings import Alone
from scenes_model import without_masks

from servoid.capture import Capture, open_capture
from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.shape import load_body
from servoid.track import Request, Subject, TrackResult, track_capture

FIRST = Request(seed=0, observations=slice(8))
HALF = np.pi


@pytest.fixture(scope="module")
def bare(alone: Alone, tmp_path_factory: pytest.TempPathFactory) -> Capture:
    """Return the recording without its masks, so that a pose is all that a start tells."""
    folder = tmp_path_factory.mktemp("bare") / "recording"
    copytree(alone.recording.folder, folder)
    return open_capture(without_masks(folder))


def known(alone: Alone, start: Pose) -> Subject:
    file = load_body(alone.folder / "body.json")
    return Subject(
        body=file.body(), start=start, fitness=file.fitness, appearance=file.look(), name="toy"
    )


def statuses(result: TrackResult) -> set[tuple[str, float]]:
    return {(one.status, one.confidence) for one in result.estimates}


@pytest.mark.parametrize(
    ("turn", "aside_m"),
    [
        pytest.param([HALF, 0.0, 0.0], 0.0, id="upside down"),
        pytest.param([0.0, HALF, 0.0], 0.0, id="turned round", marks=pytest.mark.extended),
        pytest.param([0.0, 0.0, HALF], 0.0, id="rolled", marks=pytest.mark.extended),
        pytest.param([0.0, 0.0, 0.0], 0.15, id="beside it"),
    ],
)
def test_an_object_that_is_recognised_elsewhere_in_the_images_refutes_a_start(
    turn: list[float], aside_m: float, alone: Alone, bare: Capture
) -> None:
    first = alone.points[0].world_from_object
    moved = Pose.exp([aside_m] + [0.0] * 5) @ first @ Pose.exp([0.0] * 3 + turn)
    wrong = track_capture(bare, [known(alone, moved)], FIRST)[0]
    assert statuses(wrong) == {("searching", 0.0)} and wrong.verdict == "poor"
    said = f"{1e3 * aside_m:.0f} mm and {np.degrees(np.linalg.norm(turn)):.0f} degrees"
    assert any(f"recognised {said} from the given start" in doubt for doubt in wrong.doubts)


def test_a_right_start_without_a_mask_is_followed(alone: Alone, bare: Capture) -> None:
    right = track_capture(bare, [known(alone, alone.points[0].world_from_object)], FIRST)[0]
    assert right.verdict == "good" and right.tracked_share == 1.0


def test_a_start_where_a_known_side_should_be_and_is_not_is_followed_by_its_mask_alone(
    alone: Alone, tmp_path: Path
) -> None:
    folder = tmp_path / "negatives"  # in which nothing looks as in the body's file
    copytree(alone.recording.folder, folder)
    for camera in open_capture(folder).cameras:
        for path in (picture.path for picture in camera.pictures if picture is not None):
            image = cv2.imread(str(path))
            assert image is not None
            cv2.imwrite(str(path), 255 - image)
    subject = known(alone, alone.points[0].world_from_object)
    first, *others = track_capture(open_capture(folder), [subject], FIRST)[0].estimates
    assert first.status == "searching" and {one.status for one in others} == {"tracking"}
    bare = open_capture(without_masks(folder))
    held = track_capture(bare, [subject], FIRST)[0]
    assert statuses(held) == {("searching", 0.0)} and held.verdict == "poor"
    assert any("do not match the appearance" in doubt for doubt in held.doubts)


@pytest.mark.parametrize("look", [b"AAAA", b"servoap2", b"\0" * 900])
def test_an_appearance_that_cannot_be_read_is_refused_with_a_start_as_without(
    look: bytes, alone: Alone, bare: Capture
) -> None:
    subject = known(alone, alone.points[0].world_from_object)
    for start in (subject.start, None):
        with pytest.raises(TrackError, match="the appearance in the body's file"):
            track_capture(bare, [replace(subject, start=start, appearance=look)], FIRST)

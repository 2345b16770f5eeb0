"""A camera that sees no colours is of use beside one that does."""

import shutil
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from recordings_with_truth import recording_with_truth
from test_look_alikes import AWAY_M, EYES, slender, tracker_of_slender
from tiers import tiered
from trust_verdicts import verdicts

from servoid.capture import open_capture
from servoid.track import Request, Subject, track_capture

RECORDING = "stereo/mustard"
SEEN = 30  # observations of it
IMAGES = "left", "right", "masks"


def levels_of(image: NDArray[np.uint8], *, channels: int) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) in grey levels, (H, W) or (H, W, 3)."""
    levels = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
    return levels if channels == 1 else np.repeat(levels[..., None], 3, axis=2)


@pytest.mark.parametrize("learned", [1, 3])
@pytest.mark.parametrize("compared", [1, 3])
def test_three_equal_channels_beside_an_image_in_colour_are_grey_levels(
    learned: int, compared: int
) -> None:
    tracker, place = tracker_of_slender()
    first, second = slender(0.0, 0)
    images = {count: [first, levels_of(second, channels=count)] for count in (1, 3)}
    tracker.start(0.0, EYES, images[learned], place)
    # -1 and 0 where they were learned in one form and compared in the other.
    terms = tracker.score_terms(0.1, EYES, images[compared], [[1.0, 0, 0, 0, 0, 0, AWAY_M]])
    assert terms.sum() == pytest.approx(1.0, abs=1e-6)


def mixed(grey: str, made: Path) -> Path:
    """Return the first observations of a recording, of which one camera sees no colours."""
    source = recording_with_truth(RECORDING).capture.path.parent
    for folder in IMAGES:
        (made / folder).mkdir(parents=True)
        for path in sorted((source / folder).iterdir())[:SEEN]:
            shutil.copy(path, made / folder)
            if folder == grey:
                image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
                cv2.imwrite(str(made / folder / path.name), np.asarray(image))
    shutil.copy(source / "capture.toml", made)
    return made


@cache
def known() -> Subject:
    """Learn the object in colour."""
    request = Request(seed=0, observations=slice(SEEN))
    result = track_capture(recording_with_truth(RECORDING).capture, None, request)[0]
    return Subject(body=result.body, appearance=result.appearance)


@pytest.mark.parametrize("given", tiered([False, True]))
@pytest.mark.parametrize("grey", tiered(["right", "left"]))
def test_an_object_is_tracked_by_a_camera_in_colour_and_a_grey_one(
    grey: str, *, given: bool, tmp_path: Path
) -> None:
    # 1 and 12 of 30 were, with a grey camera on the right.
    subject = known() if given else Subject()
    result = track_capture(open_capture(mixed(grey, tmp_path)), [subject], Request(seed=0))[0]
    recording = recording_with_truth(RECORDING)
    found = verdicts(result.tracked, recording.truth, recording.vertices, scaled=False)
    assert found.tracking.mean() > 0.9
    assert given or not found.wrong.any()

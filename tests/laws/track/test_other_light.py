"""An object whose appearance was saved is found in another light than that of the day before."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from faults import Moment
from recordings import Alone
from tiers import tiered

from servoid import _native
from servoid.shape import load_body
from servoid.track import cameras_of

MOST = 3  # images until it is found, at the latest
RIGHT_M = 0.01


def lit(moment: Moment, gain: float) -> Moment:
    """Return what cameras deliver in another light."""
    images = [np.clip(gain * image.astype(np.float64), 0, 255) for image in moment.images]
    return replace(moment, images=tuple(image.astype(np.uint8) for image in images))


@pytest.mark.parametrize(("gain",), [*tiered([0.6, 1.3, 0.8, 1.0, 0.7, 0.9, 1.15, 0.5], quick=2)])
def test_a_saved_object_is_found_in_another_light(alone: Alone, gain: float) -> None:
    saved = load_body(alone.folder / "body.json")
    recording = alone.recording
    tracker = _native.Tracker(cameras_of(recording.capture), saved.body())
    look = saved.look()
    assert look is not None
    tracker.recall(look)
    estimate, count = None, 0
    for count, moment in enumerate(recording.moments()[:MOST]):
        seen = lit(moment, gain)
        call: Callable[..., _native.Estimate] = tracker.step if count else tracker.find
        estimate = call(seen.time_s, seen.world_from_camera, seen.images)
        if count and estimate.status == "tracking":
            break
    assert estimate is not None and estimate.status == "tracking"
    found = np.asarray(estimate.world_from_object.matrix())
    true = recording.truth(count) @ alone.toy_from_body
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < RIGHT_M

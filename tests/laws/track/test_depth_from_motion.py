"""One camera sees points at distances that it does not know, and motion may tell them.

What was measured stands beside each bound.
"""

import numpy as np
import pytest
from recordings_with_truth import recording_with_truth
from trust_verdicts import verdicts

from servoid.track import Request, Subject, Tracked, TrackSettings, track_capture

DISTANCE_M = 0.4146


def test_motion_tells_distances_only_where_it_is_asked_to() -> None:
    assert not TrackSettings().depth_from_motion
    assert TrackSettings(depth_from_motion=True).depth_from_motion
    assert Request(depth_from_motion=True).options()["depth_from_motion"] is True


@pytest.mark.extended
def test_a_real_cube_is_followed_on_where_it_turns_and_not_trusted_where_it_is_wrong() -> None:
    recording = recording_with_truth("real/cube_hand")

    def track(*, depth_from_motion: bool) -> list[Tracked]:
        request = Request(distance_m=DISTANCE_M, seed=1, depth_from_motion=depth_from_motion)
        return list(track_capture(recording.capture, [Subject()], request)[0].tracked)

    lost = verdicts(
        track(depth_from_motion=False), recording.truth, recording.vertices, scaled=True
    )
    # 19 degrees: it is lost as soon as it turns.
    assert np.degrees(np.median(lost.turn)) > 12.0
    followed = track(depth_from_motion=True)
    # 2.2 degrees, and 2 to 8 with seeds 0 to 3.
    found = verdicts(followed, recording.truth, recording.vertices, scaled=True)
    assert np.degrees(np.median(found.turn)) < 9.0
    assert sum(one.estimate.located for one in followed) > 0.8 * len(followed)
    assert found.trusted_wrong.sum() == 0

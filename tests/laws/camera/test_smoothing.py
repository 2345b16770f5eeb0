"""Laws of a trajectory that is corrected by what was found out later."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.pose import Pose
from servoid.track.smoothing import smoothed


@dataclass(frozen=True)
class Estimated:
    """What smoothing reads of an estimate."""

    world_from_object: Pose
    keyframes: list[tuple[int, Pose]] = field(default_factory=list)


def pose(turned: float, away: float = 0.5) -> Pose:
    """Return a pose some metres away that is turned by some radians."""
    return Pose.exp([0.0, 0.01, away, 0.0, turned, 0.1 * turned])


def distance(one: Pose, other: Pose) -> float:
    """Return how far two poses are apart, in metres and radians together."""
    return float(np.linalg.norm((one.inverse() @ other).log()))


def walk(images: int, each: int, back: bool = False) -> list[Estimated]:
    """Return estimates of an even turn with a keyframe every few images, or there and back."""
    order = [*range(images), *reversed(range(images - 1))] if back else list(range(images))
    made: list[Estimated] = []
    for index in order:
        numbers = [index // each]
        if made and made[-1].keyframes[0][0] != numbers[0]:
            numbers.append(made[-1].keyframes[0][0])
        near = [(number, pose(0.02 * number * each)) for number in numbers]
        made.append(Estimated(pose(0.02 * index), near))
    return made


def test_what_nothing_corrected_stays_where_it_was() -> None:
    estimates = walk(20, 5)
    known = {number: then for one in estimates for number, then in one.keyframes}
    for before, after in zip(estimates, smoothed(estimates, known.get), strict=True):
        assert distance(before.world_from_object, after) < 1e-12


@given(st.floats(-0.3, 0.3), st.floats(-0.02, 0.02))
def test_a_pose_moves_as_its_keyframe_does(turned: float, moved: float) -> None:
    by = Pose.exp([moved, 0.0, -moved, 0.0, turned, 0.0])
    estimates = walk(10, 10)
    known = {number: then @ by for one in estimates for number, then in one.keyframes}
    for before, after in zip(estimates, smoothed(estimates, known.get), strict=True):
        assert distance(before.world_from_object @ by, after) < 1e-9


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("each", [3, 5, 8])
def test_nothing_jumps_where_one_keyframe_takes_over_from_another(each: int, back: bool) -> None:
    estimates = walk(4 * each, each, back)
    known = {number: then for one in estimates for number, then in one.keyframes}
    later = {number: one @ Pose.exp([0, 0, 0, 0, 0.1 * number, 0]) for number, one in known.items()}
    after = smoothed(estimates, later.get)
    steps = [distance(one, other) for one, other in pairwise(after)]
    even = distance(estimates[0].world_from_object, estimates[1].world_from_object)
    # A correction of 0.1 from keyframe to keyframe is spread over as many images as one lasts.
    assert max(steps) < even + 1.3 * 0.1 / each
    assert max(steps) > even


def test_where_the_object_was_not_followed_its_pose_stays() -> None:
    estimates = walk(12, 4)
    estimates[5] = Estimated(pose(1.0))
    known = {number: then for one in estimates for number, then in one.keyframes}
    moved = {number: one @ Pose.exp([0, 0, 0, 0, 0.1, 0]) for number, one in known.items()}
    after = smoothed(estimates, moved.get)
    assert distance(after[5], estimates[5].world_from_object) == 0.0
    assert distance(after[6], estimates[6].world_from_object) == pytest.approx(0.1)


def test_a_keyframe_that_is_not_known_corrects_nothing() -> None:
    estimates = walk(6, 3)
    for before, after in zip(estimates, smoothed(estimates, lambda _: None), strict=True):
        assert distance(before.world_from_object, after) == 0.0


def test_what_is_known_of_the_last_keyframe_alone_corrects_no_pose_of_another_one() -> None:
    estimates = walk(6, 3)
    moved = pose(1.0)
    after = smoothed(estimates, lambda number: moved if number == 0 else None)
    assert distance(after[3], estimates[3].world_from_object) == 0.0
    assert distance(after[0], estimates[0].world_from_object) > 0.5

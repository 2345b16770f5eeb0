"""An object whose appearance was saved is found again from the sides that were seen."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from turning_scenes import PER_TURN, Turning, followed

from servoid.pose import Pose
from servoid.shape import Body
from servoid.track import Estimate, Tracker, TrackSettings

EVERY = 6  # images between two sides: 36 degrees
MORE = 3  # images in which it may still be found
RIGHT_M, RIGHT_RAD = 0.02, 0.26
FOUND = 0.9  # of the sides: all of them, of both objects, with noise and without
NOISE = 3.0  # grey levels


@dataclass(frozen=True, eq=False)
class Seen:
    """An object that turned all the way around, and what was learned of it."""

    turning: Turning
    body: Body
    look: bytes
    poses: tuple[Pose, ...]

    def find(self, index: int, noise: float) -> list[Estimate]:
        """Search for it in an image, without a pose, and in the next ones."""
        random = np.random.default_rng(index)
        tracker = Tracker([self.turning.set_up.camera] * 2, self.body, TrackSettings(seed=index))
        tracker.recall(self.look)
        first, *others = self.turning.instants(range(index, index + 1 + MORE))
        images = [with_noise(image, noise, random) for image in first.images]
        found = [tracker.find(first.time_s, first.world_from_camera, images)]
        for one in others:
            images = [with_noise(image, noise, random) for image in one.images]
            found.append(tracker.step(one.time_s, one.world_from_camera, images))
        return found

    def is_right(self, index: int, estimate: Estimate) -> bool:
        """Return whether an estimate is near the pose that was tracked."""
        off = (self.poses[index].inverse() @ estimate.world_from_object).log()
        across, turned = np.sqrt(np.square(off).reshape(2, 3).sum(axis=1))
        return bool(across < RIGHT_M and turned < RIGHT_RAD)


def with_noise(
    image: NDArray[np.uint8] | None, noise: float, random: np.random.Generator
) -> NDArray[np.uint8]:
    """Return an image with noise of its own."""
    assert image is not None
    return np.clip(image + random.normal(0.0, noise, image.shape), 0.0, 255.0).astype(np.uint8)


@cache
def seen(name: str, seed: int) -> Seen:
    """Follow an object all the way around."""
    turning = Turning(name, seed, PER_TURN + MORE)
    one = turning.begin(known=True)
    instants = list(turning.instants())
    tracked = list(followed(one, instants[1:], evolves=False))
    assert isinstance(one.tracker, Tracker)
    poses = tuple(each.estimate.world_from_object for each in tracked)
    return Seen(turning, one.tracker.body, one.tracker.appearance(), poses)


@pytest.mark.parametrize(("name", "seed"), [("bottle", 0), ("drill", 1)])
@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_a_saved_look_finds_the_object_from_the_sides_that_were_seen_and_trusts_no_wrong_pose(
    name: str, seed: int, noise: float
) -> None:
    known = seen(name, seed)
    sides = range(0, PER_TURN, EVERY)
    found = 0
    for side in sides:
        estimates = known.find(side, noise)
        trusted = [
            known.is_right(side + number, one)
            for number, one in enumerate(estimates)
            if one.status == "tracking"
        ]
        assert all(trusted), f"side {side}"
        found += bool(trusted)
    assert found >= FOUND * len(sides)

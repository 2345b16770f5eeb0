"""Tracks and histories that a test makes up: poses of an object before cameras."""

from collections.abc import Callable, Sequence

import numpy as np
from fake_tracker import FakeEstimate, plain_body
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.track import History, LearnedSurface, Tracked

RATE_HZ = 10.0
AHEAD = 0.5  # metres from the first camera to the object


def turned(rotation: Sequence[float] | NDArray[np.float64]) -> Pose:
    """Return the pose of an object before the camera, turned by a rotation vector."""
    ahead = Pose.from_parts((0.0, 0.0, AHEAD), (1.0, 0.0, 0.0, 0.0))
    return ahead @ Pose.exp([0.0, 0.0, 0.0, *rotation])


def track_of(
    poses: Sequence[Pose], say: Callable[[int], dict[str, object]] = lambda _: {}
) -> list[Tracked]:
    """Return a track with these poses; `say` gives more of what is estimated in each place."""
    made = []
    for place, pose in enumerate(poses):
        said = {"world_from_object": pose} | say(place)
        estimate = FakeEstimate(place / RATE_HZ, **said)  # type: ignore[arg-type]
        made.append(Tracked(place, estimate, 0.002, notices=tuple(estimate.notices)))  # type: ignore
    return made


def history_of(
    count: int,
    world_from_camera: Sequence[tuple[Pose, ...]] | None = None,
    delivered: NDArray[np.bool_] | None = None,
) -> History:
    """Return the history of a track before one camera at rest, or before others."""
    poses = world_from_camera or [(Pose.identity(),)] * max(count, 1)
    cameras = len(poses[0])
    return History(
        names=tuple("abcd"[:cameras]),
        world_from_camera=tuple(poses),
        delivered=np.ones((count, cameras), np.bool_) if delivered is None else delivered,
        initial=plain_body(count=2),
        changes=(),
        surface=LearnedSurface(np.empty((0, 3)), np.empty((0, 3), np.uint8)),
    )

"""Readings of the paper: the frame of the population, and the time to which estimates belong.

The paper's equation 9 has the object in the hand's frame; the paper does not mention timestamps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from servoid._native import Estimate
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.world import World
from servoid.track.follower import Follower, Images

Frame = Callable[[], Pose]
"""Returns the pose of a tracker's frame in the world when the last images were taken."""


def in_world() -> Pose:
    """Use the world as the tracker's frame."""
    return Pose.identity()


def hand_of(world: World) -> Frame:
    """Use the hand of a world's arm as the tracker's frame."""

    def world_from_hand() -> Pose:
        exposure = world.source.handed_out
        assert exposure is not None, "nothing is tracked before an image was handed out"
        return world.arm.world_from_hand(exposure.positions_at_time)

    return world_from_hand


@dataclass(frozen=True, eq=False)
class PlacedEstimate:
    """An estimate with another pose."""

    time_s: float
    world_from_object: Pose
    covariance: Floats
    unobservable: Floats
    confidence: float
    status: str
    located: bool
    evaluations: int


def placed(
    estimate: Estimate,
    world_from_object: Pose,
    covariance: Floats | None = None,
    unobservable: Floats | None = None,
) -> Estimate:
    """Return an estimate with another pose, and other covariances (6, 6), (N, 6) if they are given.

    Fields that are not given are the estimate's own.
    """
    found = PlacedEstimate(
        time_s=estimate.time_s,
        world_from_object=world_from_object,
        covariance=estimate.covariance if covariance is None else covariance,
        unobservable=estimate.unobservable if unobservable is None else unobservable,
        confidence=estimate.confidence,
        status=estimate.status,
        located=estimate.located,
        evaluations=estimate.evaluations,
    )
    return cast("Estimate", found)  # servoing uses no other fields of an estimate


class Reading:
    """Runs a tracker in a frame of its own, and defines the time to which its estimates belong.

    With `stamped`, an estimate is the object's pose when the image was taken. Without, the object
    is assumed to be relative to the hand now as it was when the image was taken.
    """

    def __init__(self, world: World, tracker: Follower, *, in_hand: bool, stamped: bool) -> None:
        self._world, self._tracker, self._stamped = world, tracker, stamped
        self._hand = hand_of(world)
        self._frame = self._hand if in_hand else in_world
        self._seen = Pose.identity()

    @property
    def world_from_seen(self) -> Pose:
        """Return the recognised pose of the object when the last image was taken."""
        return self._seen

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn the object's appearance, with the object at a known pose."""
        frame_from_world = self._frame().inverse()
        cameras = [frame_from_world @ pose for pose in world_from_camera]
        there = frame_from_world @ world_from_object
        return self._read(self._tracker.start(time_s, cameras, images, there, masks))

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Estimate:
        """Find the object in the next observation."""
        frame_from_world = self._frame().inverse()
        cameras = [frame_from_world @ pose for pose in world_from_camera]
        return self._read(self._tracker.step(time_s, cameras, images))

    def _read(self, estimate: Estimate) -> Estimate:
        world_from_frame = self._frame()
        self._seen = world_from_frame @ estimate.world_from_object
        if self._stamped:
            return placed(estimate, self._seen)
        now = self._world.arm.world_from_hand(self._world.arm.state().positions)
        return placed(estimate, now @ self._hand().inverse() @ self._seen)

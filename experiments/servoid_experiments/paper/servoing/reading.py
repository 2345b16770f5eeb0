"""How the paper can be read: in which frame a population lives, to what time its answers belong.

The paper's equation 9 needs the object in the hand's frame; of time stamps it does not speak.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

from servoid._native import Estimate
from servoid.pose import Pose
from servoid.servo.arm import Floats
from servoid.sim.world import World
from servoid.track.follower import Follower, Images

Frame = Callable[[], Pose]
"""Tells where a tracker's frame was in the world when the last images were taken."""


def in_world() -> Pose:
    """Let a tracker live in the world."""
    return Pose.identity()


def hand_of(world: World) -> Frame:
    """Let a tracker live in the hand of a world's arm."""

    def world_from_hand() -> Pose:
        exposure = world.source.handed_out
        assert exposure is not None, "nothing is tracked before an image was handed out"
        return world.arm.world_from_hand(exposure.positions_at_time)

    return world_from_hand


@dataclass(frozen=True, eq=False)
class PlacedEstimate:
    """An estimate whose pose is put elsewhere."""

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

    What is left out is the estimate's own.
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
    return cast("Estimate", found)  # servoing asks nothing else of an estimate


class Reading:
    """Lets a tracker live in a frame of its own, and says to what time its answers belong.

    With `stamped` an answer is where the object was when the image was taken. Without, the object
    is taken to be before the hand now as it was seen before the hand then.
    """

    def __init__(self, world: World, tracker: Follower, *, in_hand: bool, stamped: bool) -> None:
        self._world, self._tracker, self._stamped = world, tracker, stamped
        self._hand = hand_of(world)
        self._frame = self._hand if in_hand else in_world
        self._seen = Pose.identity()

    @property
    def world_from_seen(self) -> Pose:
        """Return where the object was recognised when the last image was taken."""
        return self._seen

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn what the object looks like, with the object at a known pose."""
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

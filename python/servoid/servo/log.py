"""What happened in a run of visual servoing, tick by tick."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from servoid._native import Camera, Estimate
from servoid.pose import Pose
from servoid.servo.accuracy import Wish
from servoid.servo.arm import Arm, Eyes, Floats, Joints
from servoid.servo.loop import Tick
from servoid.source.source import Instant


@dataclass(frozen=True, eq=False)
class Seen:
    """One tracked observation: what the tracker said, and where the object truly was then.

    `off_px` (C, 2) is how far from the middle of each camera's image the object truly was, in
    pixels; NaN where it is not known. The log keeps no images.
    """

    instant: Instant
    estimate: Estimate | None
    truth: Pose | None
    off_px: Floats


@dataclass(frozen=True, eq=False)
class ServoRow:
    """One control period.

    `world_from_hand` is where the hand truly was, `world_from_goal` where it should have been
    (from the truth, if known), and `truth` is the true pose of the body, by where it was modelled;
    `seen` is there when an observation arrived. `hand_from_object` is where the object truly was in
    the hand, `hand_from_body` where the body was believed to be in it.
    """

    tick: Tick
    world_from_hand: Pose
    world_from_goal: Pose | None
    truth: Pose | None
    seen: Seen | None
    hand_from_object: Pose | None = None
    hand_from_body: Pose | None = None

    @property
    def time_s(self) -> float:
        """Return the time of the arm's clock, in seconds."""
        return self.tick.state.time_s


@dataclass(eq=False)
class ServoLog:
    """All control periods of a run, in order; `start_s` is when servoing began.

    `joints` and `eyes` are the arm's, None where nothing is known but the joints' `names`. `wish`
    is the desired pose of the true object in the hand, None where the truth is not known.
    """

    names: tuple[str, ...]
    start_s: float = 0.0
    rows: list[ServoRow] = field(default_factory=list)
    joints: Joints | None = None
    eyes: Eyes | None = None
    wish: Wish | None = None

    @classmethod
    def of(cls, arm: Arm) -> "ServoLog":
        """Begin the log of an arm, now."""
        return cls(
            names=arm.joints.names,
            start_s=arm.state().time_s,
            joints=arm.joints,
            eyes=arm.eyes,
        )

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, row: ServoRow) -> None:
        """Keep a control period, without its images."""
        seen = row.seen
        if seen is not None:
            seen = replace(seen, instant=replace(seen.instant, images=()))
        self.rows.append(replace(row, tick=replace(row.tick, instant=None), seen=seen))

    @property
    def cameras(self) -> tuple[str, ...]:
        """Return the cameras' names, or else numbers, by the first observation; none before it."""
        seen = next((row.seen for row in self.rows if row.seen is not None), None)
        if seen is None:
            return ()
        return seen.instant.names or tuple(str(place) for place in range(len(seen.off_px)))

    @property
    def times(self) -> Floats:
        """Return the seconds since servoing began, (T,)."""
        return np.array([row.time_s - self.start_s for row in self.rows])

    @property
    def positions(self) -> Floats:
        """Return the joints' angles in radians, (T, N)."""
        return np.array([row.tick.state.positions for row in self.rows])

    @property
    def commands(self) -> Floats:
        """Return the joint speeds that were commanded in rad/s, (T, N)."""
        return np.array([row.tick.command.velocities for row in self.rows])

    @property
    def hand_errors(self) -> Floats:
        """Return how far the hand was from its goal, (T, 6): metres in the goal's frame, rad.

        The goal is beside where the body was modelled and the object truly went: what was wrong
        then is no error here. NaN where the truth is not known. The last three are a rotation
        vector.
        """
        found = np.full((len(self.rows), 6), np.nan)
        for place, row in enumerate(self.rows):
            if row.world_from_goal is not None:
                off = row.world_from_goal.inverse() @ row.world_from_hand
                found[place, :3] = off.translation
                found[place, 3:] = Pose.from_parts([0.0, 0.0, 0.0], off.quaternion).log()[3:]
        return found

    @property
    def true_errors(self) -> Floats:
        """Return how far the hand was from its goal beside the true object, (T, 6), likewise.

        NaN where the truth is not known.
        """
        found = np.full((len(self.rows), 6), np.nan)
        for place, row in enumerate(self.rows):
            if self.wish is not None and row.hand_from_object is not None:
                found[place] = self.wish.error(row.hand_from_object)
        return found

    @property
    def seen(self) -> list[tuple[float, Seen]]:
        """List the observations with the seconds since servoing began at which they were taken."""
        return [
            (row.seen.instant.time_s - self.start_s, row.seen)
            for row in self.rows
            if row.seen is not None
        ]


def off_center(
    cameras: Sequence[Camera], world_from_camera: Sequence[Pose], point: Floats
) -> Floats:
    """Return how far from the middle of each image a point (3,) of the world is seen, (C, 2) px."""
    found = np.full((len(cameras), 2), np.nan)
    for place, (camera, pose) in enumerate(zip(cameras, world_from_camera, strict=True)):
        local = pose.inverse().transform(point[None])
        if local[0, 2] > 0.0:
            found[place] = camera.project(local)[0] - np.array(camera.center_px)
    return found

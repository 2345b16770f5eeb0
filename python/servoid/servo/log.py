"""Logs a run of visual servoing, one row per control period."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from servoid._native import Camera, Estimate
from servoid.pose import Floats, Pose
from servoid.servo.accuracy import TrueGoal
from servoid.servo.arm import Arm, Eyes, Joints
from servoid.servo.loop import Tick
from servoid.source import Instant


@dataclass(frozen=True, eq=False)
class Seen:
    """One tracked observation: the tracker's estimate, and the object's true pose at that time.

    `off_px` (C, 2) is the offset of the object's true projection from the middle of each camera's
    image, in pixels; NaN where it is not known. The log keeps no images.
    """

    instant: Instant
    estimate: Estimate | None
    truth: Pose | None
    off_px: Floats


@dataclass(frozen=True, eq=False)
class ServoRow:
    """One control period.

    `world_from_hand` is the hand's true pose, `world_from_goal` its desired pose (from the truth,
    if known), and `truth` the true pose of the body, relative to where it was modelled; `seen` is
    set if an observation arrived. `hand_from_object` is the object's true pose in the hand,
    `hand_from_body` the body's estimated one.
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
    """All control periods of a run, in order; `start_s` is the time when servoing began.

    `joints` and `eyes` are those of the arm, None if only the joints' `names` are known.
    `true_goal` is the desired pose of the true object in the hand, None if the truth is not known.
    """

    names: tuple[str, ...]
    start_s: float = 0.0
    rows: list[ServoRow] = field(default_factory=list)
    joints: Joints | None = None
    eyes: Eyes | None = None
    true_goal: TrueGoal | None = None

    @classmethod
    def of(cls, arm: Arm) -> "ServoLog":
        """Begin the log of an arm at the present time."""
        return cls(
            names=arm.joints.names,
            start_s=arm.state().time_s,
            joints=arm.joints,
            eyes=arm.eyes,
        )

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, row: ServoRow) -> None:
        """Append a control period, without its images."""
        seen = row.seen
        if seen is not None:
            seen = replace(seen, instant=replace(seen.instant, images=()))
        self.rows.append(replace(row, tick=replace(row.tick, instant=None), seen=seen))

    @property
    def cameras(self) -> tuple[str, ...]:
        """Return the cameras' names, or numbers, from the first observation; none before it."""
        seen = next((row.seen for row in self.rows if row.seen is not None), None)
        if seen is None:
            return ()
        return seen.instant.names or tuple(str(place) for place in range(len(seen.off_px)))

    @property
    def times(self) -> Floats:
        """Return the seconds since servoing began, (T,)."""
        return np.array([row.time_s - self.start_s for row in self.rows])

    @property
    def periods_s(self) -> Floats:
        """Return the durations of the control periods, (T,); for the last one, their median."""
        periods = np.diff(self.times)
        last = float(np.median(periods)) if len(periods) else 0.0
        return np.append(periods, last)[: len(self.rows)]

    @property
    def positions(self) -> Floats:
        """Return the joints' angles in radians, (T, N)."""
        return np.array([row.tick.state.positions for row in self.rows])

    @property
    def commands(self) -> Floats:
        """Return the commanded joint speeds in rad/s, (T, N)."""
        return np.array([row.tick.command.velocities for row in self.rows])

    @property
    def hand_errors(self) -> Floats:
        """Return the hand's error relative to its goal, (T, 6): metres in the goal's frame, rad.

        The goal follows the true motion of the object from where the body was modelled, so errors
        of the model do not count. NaN where the truth is not known. The last three are a rotation
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
        """Return the hand's error relative to its goal at the true object, (T, 6), likewise.

        NaN where the truth is not known.
        """
        found = np.full((len(self.rows), 6), np.nan)
        for place, row in enumerate(self.rows):
            if self.true_goal is not None and row.hand_from_object is not None:
                found[place] = self.true_goal.error(row.hand_from_object)
        return found

    @property
    def seen(self) -> list[tuple[float, Seen]]:
        """List the observations with their times in seconds since servoing began."""
        return [
            (row.seen.instant.time_s - self.start_s, row.seen)
            for row in self.rows
            if row.seen is not None
        ]


def off_center(
    cameras: Sequence[Camera], world_from_camera: Sequence[Pose], point: Floats
) -> Floats:
    """Return the offset (C, 2) px of a world point's (3,) projection from each image's middle."""
    found = np.full((len(cameras), 2), np.nan)
    for place, (camera, pose) in enumerate(zip(cameras, world_from_camera, strict=True)):
        local = pose.inverse().transform(point[None])
        if local[0, 2] > 0.0:
            found[place] = camera.project(local)[0] - np.array(camera.center_px)
    return found

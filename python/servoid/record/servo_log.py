"""What happened in a run of visual servoing, tick by tick, as a table that other programs read."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Estimate
from servoid.observe import Instant
from servoid.output import write_whole
from servoid.pose import Pose
from servoid.servo import Arm, Tick

Floats = NDArray[np.float64]
_POSE = ("w", "x", "y", "z", "tx", "ty", "tz")


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
    (from the truth, if known), and `truth` is the object's true pose; `seen` is there when an
    observation arrived.
    """

    tick: Tick
    world_from_hand: Pose
    world_from_goal: Pose | None
    truth: Pose | None
    seen: Seen | None

    @property
    def time_s(self) -> float:
        """Return the time of the arm's clock, in seconds."""
        return self.tick.state.time_s


@dataclass(eq=False)
class ServoLog:
    """All control periods of a run, in order; `start_s` is when servoing began."""

    names: tuple[str, ...]
    start_s: float = 0.0
    rows: list[ServoRow] = field(default_factory=list)

    @classmethod
    def of(cls, arm: Arm) -> "ServoLog":
        """Begin the log of an arm, now."""
        return cls(names=arm.joints.names, start_s=arm.state().time_s)

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, row: ServoRow) -> None:
        """Keep a control period, without its images."""
        seen = row.seen
        if seen is not None:
            seen = replace(seen, instant=replace(seen.instant, images=()))
        self.rows.append(replace(row, tick=replace(row.tick, instant=None), seen=seen))

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
        """Return how far the hand was from its true goal, (T, 6): metres in the goal's frame, rad.

        NaN where the truth is not known. The last three are a rotation vector.
        """
        found = np.full((len(self.rows), 6), np.nan)
        for place, row in enumerate(self.rows):
            if row.world_from_goal is not None:
                off = row.world_from_goal.inverse() @ row.world_from_hand
                found[place, :3] = off.translation
                found[place, 3:] = Pose.from_parts([0.0, 0.0, 0.0], off.quaternion).log()[3:]
        return found

    @property
    def seen(self) -> list[tuple[float, Seen]]:
        """List the observations with the seconds since servoing began at which they were taken."""
        return [
            (row.seen.instant.time_s - self.start_s, row.seen)
            for row in self.rows
            if row.seen is not None
        ]

    def write(self, path: str | Path) -> None:
        """Write the table as CSV, one line a control period; poses are (w, x, y, z, tx, ty, tz).

        Raises:
            OutputError: the file cannot be written.

        """
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(self._header())
        for row in self.rows:
            table.writerow(self._cells(row))
        write_whole(Path(path), text.getvalue().encode())

    def _header(self) -> list[str]:
        joints = [f"{kind}_{name}" for kind in ("q", "dq", "command") for name in self.names]
        poses = [
            f"{name}_{part}"
            for name in ("hand", "goal", "object_true", "object_predicted", "object_estimated")
            for part in _POSE
        ]
        gaze = [f"gaze_{name}" for name in ("tilt", "pan_left", "pan_right")]
        seen = ["image", "image_time_s", "status", "confidence", "off_left_u_px", "off_left_v_px"]
        seen += ["off_right_u_px", "off_right_v_px"]
        return [
            "time_s",
            *joints,
            *poses,
            *gaze,
            *seen,
            "holding",
            "limiting",
            "track_s",
            "control_s",
        ]

    def _cells(self, row: ServoRow) -> list[str]:
        tick, seen = row.tick, row.seen
        command = tick.command
        estimate = None if seen is None else seen.estimate
        found = None if estimate is None else estimate.world_from_object
        numbers = [*tick.state.positions, *tick.state.velocities, *command.velocities]
        cells = [f"{row.time_s:.6f}", *map(_number, numbers)]
        poses = (row.world_from_hand, row.world_from_goal, row.truth, command.world_from_object)
        for pose in (*poses, found):
            cells += _pose(pose)
        cells += [""] * 3 if command.gaze is None else [*map(_number, command.gaze)]
        if seen is None:
            cells += [""] * 8
        else:
            cells += [str(seen.instant.index), f"{seen.instant.time_s:.6f}"]
            cells += (
                ["dark", ""]
                if estimate is None
                else [estimate.status, _number(estimate.confidence)]
            )
            off = [*map(_number, seen.off_px.ravel()[:4])]
            cells += [*off, *[""] * (4 - len(off))]
        cells += [_reasons(command.holding), _reasons(command.limiting)]
        return [*cells, _number(tick.track_s), _number(tick.control_s)]


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


def _pose(pose: Pose | None) -> list[str]:
    if pose is None:
        return [""] * len(_POSE)
    return [*map(_number, (*pose.quaternion, *pose.translation))]


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.9g}"


def _reasons(reasons: frozenset[object]) -> str:
    return " ".join(sorted(str(getattr(reason, "name", reason)).lower() for reason in reasons))

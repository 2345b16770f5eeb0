"""Writes what happened in a run of visual servoing as a table that other programs read."""

import csv
import io
from collections.abc import Iterable
from itertools import repeat
from pathlib import Path

import numpy as np

from servoid.output import write_whole
from servoid.pose import Pose
from servoid.servo import Reason, Seen, ServoLog, ServoRow

_POSE = ("w", "x", "y", "z", "tx", "ty", "tz")
_POSES = ("hand", "goal", "object_true", "object_predicted", "object_estimated")
_SEEN = (
    "image",
    "image_time_s",
    "status",
    "confidence",
    "off_left_u_px",
    "off_left_v_px",
    "off_right_u_px",
    "off_right_v_px",
)


def write_servo_log(log: ServoLog, path: str | Path) -> None:
    """Write a log as CSV, one line a control period; poses are (w, x, y, z, tx, ty, tz).

    Raises:
        OutputError: the file cannot be written.

    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(_header(log.names))
    table.writerows(_cells(row) for row in log.rows)
    write_whole(Path(path), text.getvalue().encode())


def _header(names: tuple[str, ...]) -> list[str]:
    return [
        "time_s",
        *(f"{kind}_{name}" for kind in ("q", "dq", "command") for name in names),
        *(f"{name}_{part}" for name in _POSES for part in _POSE),
        *(f"gaze_{name}" for name in ("tilt", "pan_left", "pan_right")),
        *_SEEN,
        "holding",
        "limiting",
        "track_s",
        "control_s",
    ]


def _cells(row: ServoRow) -> list[str]:
    tick, seen = row.tick, row.seen
    command = tick.command
    estimate = None if seen is None else seen.estimate
    found = None if estimate is None else estimate.world_from_object
    poses = (row.world_from_hand, row.world_from_goal, row.truth, command.world_from_object, found)
    return [
        f"{row.time_s:.6f}",
        *_numbers(tick.state.positions),
        *_numbers(tick.state.velocities),
        *_numbers(command.velocities),
        *(cell for pose in poses for cell in _pose(pose)),
        *_numbers(repeat(np.nan, 3) if command.gaze is None else command.gaze),
        *_seen(seen),
        _reasons(command.holding),
        _reasons(command.limiting),
        *_numbers((tick.track_s, tick.control_s)),
    ]


def _seen(seen: Seen | None) -> list[str]:
    if seen is None:
        return [""] * len(_SEEN)
    cells = [str(seen.instant.index), f"{seen.instant.time_s:.6f}"]
    if seen.estimate is None:
        cells += ["dark", ""]
    else:
        cells += [seen.estimate.status, *_numbers([seen.estimate.confidence])]
    cells += _numbers(seen.off_px.ravel()[:4])
    return cells + [""] * (len(_SEEN) - len(cells))


def _pose(pose: Pose | None) -> list[str]:
    if pose is None:
        return [""] * len(_POSE)
    return _numbers((*pose.quaternion, *pose.translation))


def _numbers(values: Iterable[float]) -> list[str]:
    return ["" if np.isnan(value) else f"{value:.9g}" for value in values]


def _reasons(reasons: frozenset[Reason]) -> str:
    return " ".join(sorted(reason.name.lower() for reason in reasons))

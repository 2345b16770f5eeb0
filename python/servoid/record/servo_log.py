"""Writes the log of a servo run as tables for other programs."""

import csv
import io
from collections.abc import Iterable
from itertools import repeat
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.output import write_whole
from servoid.pose import Pose, exact
from servoid.servo import Reason, Seen, ServoLog, ServoRow

_POSE = ("w", "x", "y", "z", "tx", "ty", "tz")
_POSES = ("hand", "goal", "object_true", "object_predicted", "object_estimated")
_SEEN = ("image", "image_time_s", "status", "confidence", "std_m", "std_rad")


def write_servo_log(log: ServoLog, path: str | Path) -> None:
    """Write a log as CSV, one line per control period; poses are (w, x, y, z, tx, ty, tz).

    The file does not depend on the computer: the same run gives the same bytes.

    Raises:
        OutputError: the file cannot be written.

    """
    cameras = log.cameras
    _write(path, _header(log.names, cameras), (_cells(row, len(cameras)) for row in log.rows))


def write_servo_times(log: ServoLog, path: str | Path) -> None:
    """Write as CSV the wall times of tracker and controller in each control period.

    Raises:
        OutputError: the file cannot be written.

    """
    header = ["time_s", "track_s", "control_s"]
    times = ((row.time_s, row.tick.track_s, row.tick.control_s) for row in log.rows)
    _write(path, header, ([f"{time_s:.6f}", *_numbers(spent)] for time_s, *spent in times))


def _write(path: str | Path, header: list[str], lines: Iterable[list[str]]) -> None:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(header)
    table.writerows(lines)
    write_whole(Path(path), text.getvalue().encode())


def _header(names: tuple[str, ...], cameras: tuple[str, ...]) -> list[str]:
    return [
        "time_s",
        *(f"{kind}_{name}" for kind in ("q", "dq", "command") for name in names),
        *(f"{name}_{part}" for name in _POSES for part in _POSE),
        *(f"gaze_{name}" for name in ("tilt", "pan_left", "pan_right")),
        *_SEEN,
        *(f"off_{camera}_{axis}_px" for camera in cameras for axis in "uv"),
        "holding",
        "limiting",
    ]


def _cells(row: ServoRow, cameras: int) -> list[str]:
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
        *_seen(seen, cameras),
        _reasons(command.holding),
        _reasons(command.limiting),
    ]


def _seen(seen: Seen | None, cameras: int) -> list[str]:
    if seen is None:
        return [""] * (len(_SEEN) + 2 * cameras)
    cells = ["dark", "", "", ""]
    if seen.estimate is not None:
        whole = seen.estimate.covariance
        worst = (_worst(whole[:3, :3]), _worst(whole[3:, 3:]))
        cells = [seen.estimate.status, *_numbers([seen.estimate.confidence, *worst])]
    return [
        str(seen.instant.index),
        f"{seen.instant.time_s:.6f}",
        *cells,
        *_numbers(seen.off_px.ravel()),
    ]


def _worst(covariance: NDArray[np.float64]) -> float:
    """Return the standard deviation in its worst direction, NaN if not known."""
    if not np.isfinite(covariance).all():
        return np.nan
    return float(np.sqrt(max(0.0, float(exact.eigh(covariance)[0][-1]))))


def _pose(pose: Pose | None) -> list[str]:
    if pose is None:
        return [""] * len(_POSE)
    return _numbers((*pose.quaternion, *pose.translation))


def _numbers(values: Iterable[float]) -> list[str]:
    return ["" if np.isnan(value) else f"{value:.9g}" for value in values]


def _reasons(reasons: frozenset[Reason]) -> str:
    return " ".join(sorted(reason.name.lower() for reason in reasons))

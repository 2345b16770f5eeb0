"""Reads and writes trajectories, an object's poses over time, as `poses.csv` or TUM text."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from servoid._native import Pose
from servoid.capture import unordered_times
from servoid.config import POSES_FILE, read_text
from servoid.errors import OutputError, TrajectoryError, located
from servoid.output import write_whole
from servoid.track import Tracked
from servoid.words import counted, number_of

CSV_HEADER = ("time_s", "x", "y", "z", "qw", "qx", "qy", "qz", "confidence", "status")
CSV_FURTHER = ("observation", "std_m", "std_rad", "notices")
TUM_HEADER = ("time_s", "x", "y", "z", "qx", "qy", "qz", "qw")
STATUSES = ("tracking", "searching", "lost")
SUFFIXES = (".csv", ".tum", ".txt")

_BETWEEN_NOTICES = "; "


class _Rows(Protocol):
    """Rows of a table, and the line on which the last one ended."""

    line_num: int

    def __iter__(self) -> Iterator[list[str]]: ...

    def __next__(self) -> list[str]: ...


@dataclass(frozen=True)
class Waypoint:
    """The pose of the object at one instant.

    `status` is tracking, searching or lost; trust a pose only where it is tracking.
    `confidence` is 0 to 1, NaN where the file has none. `observation` counts those of the capture;
    `std_m` and `std_rad` are the standard deviations of position and rotation in their worst
    direction, None where they are not known; `notices` describe problems of the observation.
    """

    time_s: float
    world_from_object: Pose
    confidence: float = math.nan
    status: str = "tracking"
    observation: int | None = None
    std_m: float | None = None
    std_rad: float | None = None
    notices: str = ""


def waypoints(
    tracked: Sequence[Tracked],
    smoothed: Sequence[Pose] | None = None,
    *,
    notices_on_all: Sequence[str] = (),
) -> list[Waypoint]:
    """Return the waypoints of estimates, with `smoothed` poses in place of their own if given.

    `notices_on_all` are added to the notices of each.
    """
    if smoothed is None:
        smoothed = [one.estimate.world_from_object for one in tracked]
    return [
        Waypoint(
            time_s=one.estimate.time_s,
            world_from_object=pose,
            confidence=one.estimate.confidence,
            status=one.estimate.status,
            observation=one.index,
            std_m=_worst(one.estimate.covariance[:3, :3]),
            std_rad=_worst(one.estimate.covariance[3:, 3:]),
            notices=_BETWEEN_NOTICES.join((*one.notices, *notices_on_all)),
        )
        for one, pose in zip(tracked, smoothed, strict=True)
    ]


def check_suffix(path: Path) -> None:
    """Check that the ending of a file is that of a trajectory.

    Raises:
        OutputError: it ends in none of `SUFFIXES`.

    """
    if path.suffix.lower() not in SUFFIXES:
        raise OutputError(
            f"cannot write {path}: a trajectory ends in .csv, or in .tum or .txt for TUM text"
        )


def write_trajectory(path: str | Path, points: Sequence[Waypoint]) -> None:
    """Write a trajectory, whole or not at all: CSV or, by the file's ending, TUM text.

    TUM text holds only the tracked poses, since the format has no status.

    Raises:
        OutputError: the file cannot be written, or ends in none of .csv, .tum and .txt.

    """
    path = Path(path)
    check_suffix(path)
    text = _csv(points) if path.suffix.lower() == ".csv" else _tum(points)
    write_whole(path, text.encode("utf-8"))


def read_trajectory(path: str | Path) -> list[Waypoint]:
    """Read a trajectory: CSV or, by the file's ending, TUM text.

    A CSV needs the first eight columns; unknown columns are ignored. Lines without a status, such
    as all lines of TUM text, count as tracked.

    Raises:
        TrajectoryError: the file is missing or malformed, most of its times do not increase, or it
            ends in none of .csv, .tum and .txt.
        PoseError: a line holds no rigid motion; the message names file and line.

    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise TrajectoryError(
            f"{path}: a trajectory ends in .csv, or in .tum or .txt for TUM text; rename the file"
        )
    text = read_text(path, TrajectoryError, POSES_FILE)
    points = _read_csv(path, text) if path.suffix.lower() == ".csv" else _read_tum(path, text)
    unordered = unordered_times([point.time_s for point in points])
    if unordered is not None:
        raise TrajectoryError(f"{path}: {unordered}")
    return points


def _worst(covariance: np.ndarray) -> float | None:
    """Return the standard deviation along the worst direction, None if it is not known."""
    if not np.isfinite(covariance).all():
        return None
    return math.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0))


def _parts(pose: Pose) -> tuple[list[str], list[str]]:
    """Return a pose as text, to a nanometre: x, y, z and, with w not negative, w, x, y, z."""
    w, x, y, z = pose.quaternion
    sign = -1.0 if w < 0.0 else 1.0
    return (
        [_fixed(value) for value in pose.translation],
        [_fixed(sign * value) for value in (w, x, y, z)],
    )


def _fixed(value: float) -> str:
    text = f"{value:.9f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _csv(points: Sequence[Waypoint]) -> str:
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow((*CSV_HEADER, *CSV_FURTHER))
    for point in points:
        place, turn = _parts(point.world_from_object)
        confidence = "" if math.isnan(point.confidence) else f"{point.confidence:.4f}"
        further = (
            point.observation,
            None if point.std_m is None else f"{point.std_m:.3g}",
            None if point.std_rad is None else f"{point.std_rad:.3g}",
            point.notices,
        )
        writer.writerow((repr(point.time_s), *place, *turn, confidence, point.status, *further))
    return file.getvalue()


def _tum(points: Sequence[Waypoint]) -> str:
    lines = []
    for point in points:
        if point.status == "tracking":
            place, (w, x, y, z) = _parts(point.world_from_object)
            lines.append(" ".join((repr(point.time_s), *place, x, y, z, w)))
    return "".join(f"{line}\n" for line in lines)


def _read_csv(path: Path, text: str) -> list[Waypoint]:
    # Lines may end as on any system; errors in the table name their line.
    rows = csv.reader(io.StringIO(text, newline=None))
    try:
        return _read_rows(path, rows)
    except csv.Error as error:
        raise TrajectoryError(
            f"{path}, line {rows.line_num}: this is no line of a table ({error}); write it anew"
        ) from error


def _read_rows(path: Path, rows: "_Rows") -> list[Waypoint]:
    header = tuple(cell.strip() for cell in next(rows, []))
    needed = CSV_HEADER[:8]
    if header[:8] != needed:
        raise TrajectoryError(
            f"{path}, line 1: the header is '{','.join(header)}'; it must begin with "
            f"'{','.join(needed)}'"
        )
    points = []
    for cells in rows:
        place = f"{path}, line {rows.line_num}"
        if not cells:
            continue
        if len(cells) != len(header):
            raise TrajectoryError(
                f"{place}: {counted(len(cells), 'value was', 'values were')} given, but the "
                f"header names {len(header)}"
            )
        points.append(_waypoint(dict(zip(header, map(str.strip, cells), strict=True)), place))
    return points


def _waypoint(cells: dict[str, str], place: str) -> Waypoint:
    time_s, *pose = (_number(cells[name], name, place) for name in CSV_HEADER[:8])
    status = cells.get("status") or "tracking"
    if status not in STATUSES:
        raise TrajectoryError(f"{place}: status is '{status}'; write one of {', '.join(STATUSES)}")
    further = {
        name: _number(cells[name], name, place) if cells.get(name) else None
        for name in ("confidence", "observation", "std_m", "std_rad")
    }
    confidence, observation = further["confidence"], further["observation"]
    if confidence is not None and not 0.0 <= confidence <= 1.0:
        raise TrajectoryError(
            f"{place}: confidence is {cells['confidence']}; write a number from 0 to 1"
        )
    with located(place):
        return Waypoint(
            time_s=time_s,
            world_from_object=Pose.from_parts(pose[:3], pose[3:]),
            confidence=math.nan if confidence is None else confidence,
            status=status,
            observation=None if observation is None else int(observation),
            std_m=further["std_m"],
            std_rad=further["std_rad"],
            notices=cells.get("notices", ""),
        )


def _read_tum(path: Path, text: str) -> list[Waypoint]:
    points = []
    for number, line in enumerate(text.splitlines(), start=1):
        cells = line.split()
        if not cells or cells[0].startswith("#"):
            continue
        place = f"{path}, line {number}"
        if len(cells) != len(TUM_HEADER):
            raise TrajectoryError(
                f"{place}: {counted(len(cells), 'value was', 'values were')} given; TUM text has "
                f"{len(TUM_HEADER)}, separated "
                "by blanks: time tx ty tz qx qy qz qw"
            )
        named = zip(cells, TUM_HEADER, strict=True)
        time_s, *pose = (_number(cell, name, place) for cell, name in named)
        x, y, z, w = pose[3:]
        with located(place):
            points.append(Waypoint(time_s, Pose.from_parts(pose[:3], (w, x, y, z))))
    return points


def _number(cell: str, name: str, place: str) -> float:
    try:
        value = number_of(cell)
    except ValueError as error:
        raise TrajectoryError(f"{place}: {name} is '{cell}'; write a number") from error
    if not math.isfinite(value):
        raise TrajectoryError(f"{place}: {name} is {cell}; write a finite number")
    return value

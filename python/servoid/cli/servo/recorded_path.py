"""Reads the path of an object from a file of its poses over time."""

from dataclasses import dataclass
from pathlib import Path

from servoid.cli.servo.servo_order import RECORDED
from servoid.errors import TrajectoryError, located
from servoid.record import read_trajectory
from servoid.sim.trial import TrialSettings
from servoid.sim.world import Path as ObjectPath
from servoid.sim.world import Recorded
from servoid.words import are, counted

_TRACKING = "tracking"


@dataclass(frozen=True)
class GivenPath:
    """The recorded path of an object, with notes on its file; None if no file is named."""

    path: ObjectPath | None = None
    notes: tuple[str, ...] = ()


def recorded_file(settings: TrialSettings) -> Path | None:
    """Return the file of the object's path, None if no file is named."""
    text = settings.world.object.path
    return Path(text.removeprefix(RECORDED)) if text.startswith(RECORDED) else None


def read_path(settings: TrialSettings) -> GivenPath:
    """Read the object's path from its file, if one is named; only poses that are tracked count.

    Raises:
        TrajectoryError, PoseError: the file cannot be read, or fewer than two poses are tracked.
        SimError: the poses make no path.

    """
    file = recorded_file(settings)
    if file is None:
        return GivenPath()
    points = read_trajectory(file)
    kept = [point for point in points if point.status == _TRACKING]
    left_out = len(points) - len(kept)
    if left_out and len(kept) < 2:
        raise TrajectoryError(
            f"{file}: of {counted(len(points), 'pose')}, {len(kept)} {are(len(kept))} "
            f"{_TRACKING}, and a path needs two or more; where the status is searching or lost, "
            "the pose is a guess: give a track that follows the object"
        )
    with located(str(file)):
        path = Recorded([one.time_s for one in kept], [one.world_from_object for one in kept])
    if not left_out:
        return GivenPath(path)
    note = (
        f"{file}: {left_out} of {counted(len(points), 'pose')} {are(left_out)} searching or lost, "
        "and left out; the path leads from each tracked pose to the next"
    )
    return GivenPath(path, (note,))

"""Small servo runs: a painted ellipsoid before a plain wall, seen by coarse cameras."""

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from servoid.record import write_servo_log
from servoid.servo import ServoLog
from servoid.sim.trial import ServoTrial, TrialSettings, TrialStep, changed, run_servo_trial

SMALL: dict[str, Any] = {
    "world.ideal": True,
    "run.seconds": 3.0,
    "run.max_ellipsoids": 1,
    "world.background": "plain",
    "world.object.name": "painted_ellipsoid",
    "world.object.path": "sine:0.05@4s",
    "world.cameras.size_px": [320, 240],
    "world.cameras.samples": 1,
    "world.cameras.moments": 1,
    "servo.look.count": 2,
}


def small_settings(values: dict[str, Any] | None = None) -> TrialSettings:
    return changed(TrialSettings(), SMALL | (values or {}), "the test")


def small_trial(
    folder: Path,
    values: dict[str, Any] | None = None,
    watch: Callable[[TrialStep], None] | None = None,
) -> ServoTrial:
    """Make a small run with some settings changed, by their dotted names."""
    return run_servo_trial(small_settings(values), folder, watch=watch)


def position_errors(log: ServoLog, from_s: float = 0.0, to_s: float = np.inf) -> np.ndarray:
    """Return the distances of the hand from its true goal in metres, between two times."""
    chosen = (log.times >= from_s) & (log.times < to_s)
    return np.linalg.norm(log.hand_errors[chosen, :3], axis=1)


def turn_errors(log: ServoLog, from_s: float = 0.0) -> np.ndarray:
    """Return the hand's turns off its true goal in radians, from a time on."""
    return np.linalg.norm(log.hand_errors[log.times >= from_s, 3:], axis=1)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def log_rows(path: Path) -> list[dict[str, str]]:
    """Read the log of a run."""
    return list(csv.DictReader(io.StringIO(path.read_text())))


def logged(trial: ServoTrial, folder: Path) -> list[dict[str, str]]:
    """Write the log of a run and read it back, as `log_rows` does."""
    write_servo_log(trial.log, folder / "log.csv")
    return log_rows(folder / "log.csv")

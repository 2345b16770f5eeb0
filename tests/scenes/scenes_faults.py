"""Servo runs in which something goes wrong, and how the hand bears it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_table import Figures, Scene, scene
from scenes_servo import seeded
from servo_trials import position_errors, small_trial

import servoid.sim.trial.servoing as servo_trial
from servoid.servo import Reason, ServoLog
from servoid.sim.trial import ServoTrial

AT_S, SECONDS = 1.2, 1.0
NOTICED_S = 0.6  # delay of images, what is bridged, and braking
SLIDING_S = 0.3  # in which the board that occludes is on its way out

FAULTS: dict[str, tuple[dict[str, Any], Reason]] = {
    "images_dropped": ({"type": "drop", "seconds": SECONDS}, Reason.NO_IMAGES),
    "both_cameras_frozen": ({"type": "freeze", "seconds": SECONDS}, Reason.FROZEN),
    "one_camera_frozen": ({"type": "freeze", "seconds": SECONDS, "camera": 1}, Reason.FROZEN),
    "occluded": ({"type": "occlude", "seconds": 1.6}, Reason.LOST),
}
JUMPED = {Reason.TELEPORT, Reason.SEARCHING, Reason.LOST}  # as the tracker takes a teleport


def between(log: ServoLog, from_s: float, to_s: float) -> np.ndarray:
    return (log.times >= from_s) & (log.times < to_s)


def hand_speeds(log: ServoLog, from_s: float = 0.0, to_s: float = np.inf) -> np.ndarray:
    """Return how fast the hand is from each control period to the next, in m/s."""
    places = np.array([row.world_from_hand.translation for row in log.rows])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(log.times)
    return speeds[between(log, from_s, to_s)[1:]]


def held(log: ServoLog, from_s: float, to_s: float) -> list[frozenset[Reason]]:
    """Return why the hand is held, one set for each control period in which it is."""
    chosen = [log.rows[place] for place in np.flatnonzero(between(log, from_s, to_s))]
    return [row.tick.command.holding for row in chosen if row.tick.command.holding]


def reasons(log: ServoLog, from_s: float, to_s: float) -> set[Reason]:
    return {reason for one in held(log, from_s, to_s) for reason in one}


def faulty(folder: Path, seed: int, fault: dict[str, Any] | None, **more: Any) -> ServoTrial:
    faults = [] if fault is None else [{"at_s": AT_S, **fault}]
    values = {"servo.look.count": 1, "run.seconds": 4.8, "world.faults": faults}
    return small_trial(folder, seeded(seed, values | more))


def end_figures(log: ServoLog) -> Figures:
    """Say how far the hand is from its goal at last, and whether it is held even then."""
    return {
        "end error": 1e3 * float(position_errors(log, log.times[-1] - 0.5).max()),
        "held at last": float(bool(log.rows[-1].tick.command.holding)),
    }


END = {"end error": "mm", "held at last": "1"}
HELD = {**END, "held before": "periods", "unnoticed": "1"}
CREEPING = "occluded"  # the board on its way out lets the tracker see a little of the object


def held_figures(log: ServoLog, reason: Reason, until_s: float) -> Figures:
    """Say whether a fault is noticed, and nothing before it."""
    return {
        **end_figures(log),
        "held before": len(held(log, 0.3, AT_S)),
        "unnoticed": float(reason not in reasons(log, AT_S, until_s + 0.1)),
    }


def held_speed(log: ServoLog, until_s: float) -> float:
    """Return how fast the held hand is at most, in m/s."""
    return float(hand_speeds(log, AT_S + NOTICED_S, until_s).max())


def fault_figures(name: str, log: ServoLog) -> Figures:
    """Say how a fault of `FAULTS` is borne."""
    fault, reason = FAULTS[name]
    until_s = AT_S + fault["seconds"]
    found = held_figures(log, reason, until_s)
    if name != CREEPING:
        return found
    return {**found, "held speed": 1e3 * held_speed(log, until_s - SLIDING_S)}


def _holding(name: str) -> Scene:
    more = {"held speed": "mm/s"} if name == CREEPING else {}

    @scene(f"fault {name.replace('_', ' ')}", {**HELD, **more})
    def holding(seed: int, folder: Path) -> Figures:
        return fault_figures(name, faulty(folder, seed, FAULTS[name][0]).log)

    return holding


HOLDING = {name: _holding(name) for name in FAULTS}
ONE_LOST = {"type": "drop", "seconds": SECONDS, "camera": 0}


def one_lost_figures(log: ServoLog) -> Figures:
    return {
        **end_figures(log),
        "held": len(held(log, 0.3, 9.0)),
        "error": 1e3 * float(position_errors(log, 1.0).max()),
    }


@scene("fault one camera lost", {**END, "held": "periods", "error": "mm"})
def one_lost(seed: int, folder: Path) -> Figures:
    return one_lost_figures(faulty(folder, seed, ONE_LOST).log)


MOVED_AWAY = {"type": "teleport", "by": [0.1, -0.05, 0.0]}
STILL = {"world.object.path": "still"}


def moved_away_figures(log: ServoLog) -> Figures:
    """Say how the hand goes to an object that was moved away.

    An object that is found again at once may have moved fast, so that the hand is startled; the
    next images tell that it rests, and the hand begins anew from rest.
    """
    away = float(position_errors(log, AT_S + 0.1)[0])
    begins = np.lib.stride_tricks.sliding_window_view(hand_speeds(log, AT_S + 0.1, AT_S + 1.0), 5)
    return {
        **end_figures(log),
        "unnoticed": float(not JUMPED & reasons(log, AT_S, 2.5)),
        "away off": 1e3 * abs(away - 0.11),
        "startled speed": 1e3 * float(hand_speeds(log, AT_S + 0.3, AT_S + 0.4).max()),
        "resting speed": 1e3 * float(begins.max(axis=1).min()),
        "speed": 1e3 * float(hand_speeds(log).max()),
    }


@scene(
    "fault moved away",
    {
        **END,
        "unnoticed": "1",
        "away off": "mm",
        "startled speed": "mm/s",
        "resting speed": "mm/s",
        "speed": "mm/s",
    },
)
def moved_away(seed: int, folder: Path) -> Figures:
    return moved_away_figures(faulty(folder, seed, MOVED_AWAY, **STILL).log)


@dataclass
class NoPose:
    """A pose that another tracker than ours may report."""

    def matrix(self) -> np.ndarray:
        return np.full((4, 4), np.nan)


@dataclass
class Spoilt:
    """An estimate whose pose is no pose."""

    estimate: Any
    world_from_object: Any = field(default_factory=NoPose)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.estimate, name)


@dataclass
class Failing:
    """Passes on what a tracker says but for a second in which its poses are no numbers."""

    tracker: Any
    from_s: float

    def step(self, time_s: float, poses: Any, images: Any) -> Any:
        estimate = self.tracker.step(time_s, poses, images)
        failing = self.from_s <= time_s < self.from_s + SECONDS
        return Spoilt(estimate) if failing else estimate


def with_no_numbers(folder: Path, seed: int) -> ServoTrial:
    """Make a run whose tracker reports poses that are no numbers for a second."""
    start = servo_trial._start_tracker

    def failing(world: Any, *given: Any) -> Failing:
        return Failing(start(world, *given), world.time_s + AT_S)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(servo_trial, "_start_tracker", failing)
        return faulty(folder, seed, None)


@scene("fault no numbers", HELD)
def no_numbers(seed: int, folder: Path) -> Figures:
    log = with_no_numbers(folder, seed).log
    return held_figures(log, Reason.NOT_FINITE, AT_S + SECONDS)

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from servo_trials import position_errors, small_trial

import servoid.study.servo_trial as servo_trial
from servoid.pose import Pose
from servoid.servo import Reason, ServoLog
from servoid.study import ServoTrial

AT_S, SECONDS = 1.2, 1.0
NOTICED_S = 0.6  # delay of images, what is bridged, and braking
SLIDING_S = 0.3  # in which the board that occludes is on its way out

FAULTS: dict[str, tuple[dict[str, Any], Reason]] = {
    "images_dropped": ({"type": "drop", "seconds": SECONDS}, Reason.NO_IMAGES),
    "both_cameras_frozen": ({"type": "freeze", "seconds": SECONDS}, Reason.FROZEN),
    "one_camera_frozen": ({"type": "freeze", "seconds": SECONDS, "camera": 1}, Reason.FROZEN),
    "occluded": ({"type": "occlude", "seconds": 1.6}, Reason.LOST),
}


def between(log: ServoLog, from_s: float, to_s: float) -> np.ndarray:
    return (log.times >= from_s) & (log.times < to_s)


def hand_speeds(log: ServoLog) -> np.ndarray:
    """Return how fast the hand is from each control period to the next, in m/s."""
    places = np.array([row.world_from_hand.translation for row in log.rows])
    return np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(log.times)


def reasons(log: ServoLog, from_s: float, to_s: float) -> set[Reason]:
    chosen = np.flatnonzero(between(log, from_s, to_s))
    return {reason for place in chosen for reason in log.rows[place].tick.command.holding}


def check_limits(trial: ServoTrial) -> None:
    joints, log = trial.world.arm.joints, trial.log
    steps = np.abs(np.diff(log.commands, axis=0)) / trial.world.arm.period_s
    assert np.all(np.isfinite(log.commands))
    assert np.all(steps <= joints.acceleration * (1.0 + 1e-9))
    assert np.all(np.abs(log.commands) <= joints.speed)


def faulty(folder: Path, fault: dict[str, Any] | None, **more: Any) -> ServoTrial:
    faults = [] if fault is None else [{"at_s": AT_S, **fault}]
    values = {"servo.look.count": 1, "run.seconds": 4.8, "world.faults": faults}
    return small_trial(folder, values | more)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_stops_the_hand_smoothly_and_afterwards_it_is_at_its_goal_again(
    name: str, tmp_path: Path
) -> None:
    fault, reason = FAULTS[name]
    trial = faulty(tmp_path, fault)
    log, until = trial.log, AT_S + fault["seconds"]
    check_limits(trial)
    assert reasons(log, 0.3, AT_S) == set()
    assert reason in reasons(log, AT_S, until + 0.1)
    held = between(log, AT_S + NOTICED_S, until - SLIDING_S)[1:]
    assert hand_speeds(log)[held].max() < 5e-3
    assert not log.rows[-1].tick.command.holding
    assert position_errors(log, log.times[-1] - 0.5).max() < 0.02


def test_one_lost_camera_does_not_stop_the_hand(tmp_path: Path) -> None:
    trial = faulty(tmp_path, {"type": "drop", "seconds": SECONDS, "camera": 0})
    check_limits(trial)
    assert reasons(trial.log, 0.3, 9.0) == set()
    assert position_errors(trial.log, 1.0).max() < 0.05
    assert position_errors(trial.log, trial.log.times[-1] - 0.5).max() < 0.02


def test_an_object_that_was_moved_away_is_met_again_from_rest(tmp_path: Path) -> None:
    away = {"type": "teleport", "by": [0.1, -0.05, 0.0]}
    trial = faulty(tmp_path, away, **{"world.object.path": "still"})
    log = trial.log
    check_limits(trial)
    # The tracker may doubt the leap by itself, before the servo does.
    assert {Reason.TELEPORT, Reason.SEARCHING} & reasons(log, AT_S, 2.5)
    assert position_errors(log, AT_S + 0.1)[0] == pytest.approx(0.11, abs=0.02)
    resting = hand_speeds(log)[between(log, AT_S + 0.3, AT_S + 0.4)[1:]]
    assert resting.max() < 0.02
    assert hand_speeds(log).max() < 0.5
    assert not log.rows[-1].tick.command.holding
    assert position_errors(log, log.times[-1] - 0.5).max() < 0.02


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


def test_poses_that_are_no_numbers_hold_the_arm(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = servo_trial._start_tracker

    def failing(world: Any, *given: Any) -> Failing:
        return Failing(start(world, *given), world.time_s + AT_S)

    monkeypatch.setattr(servo_trial, "_start_tracker", failing)
    trial = faulty(tmp_path, None)
    log = trial.log
    check_limits(trial)
    assert reasons(log, AT_S, AT_S + SECONDS) >= {Reason.NOT_FINITE}
    held = between(log, AT_S + NOTICED_S, AT_S + SECONDS)[1:]
    assert hand_speeds(log)[held].max() < 5e-3
    assert position_errors(log, log.times[-1] - 0.5).max() < 0.02
    assert isinstance(log.rows[-1].truth, Pose)

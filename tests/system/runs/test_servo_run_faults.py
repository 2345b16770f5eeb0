from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from scenes_faults import (
    AT_S,
    CREEPING,
    FAULTS,
    HOLDING,
    MOVED_AWAY,
    ONE_LOST,
    SECONDS,
    STILL,
    fault_figures,
    faulty,
    held_figures,
    held_speed,
    moved_away,
    moved_away_figures,
    no_numbers,
    one_lost,
    one_lost_figures,
    with_no_numbers,
)

from servoid.pose import Pose
from servoid.servo import Reason
from servoid.sim.trial import ServoTrial

pytestmark = pytest.mark.extended

STILL_M_S = 5e-3  # of a hand that is held, far above what is seen but where the object half is


def check_limits(trial: ServoTrial) -> None:
    joints, log = trial.world.arm.joints, trial.log
    steps = np.abs(np.diff(log.commands, axis=0)) / trial.world.arm.period_s
    assert np.all(np.isfinite(log.commands))
    assert np.all(steps <= joints.acceleration * (1.0 + 1e-9))
    assert np.all(np.abs(log.commands) <= joints.speed)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_stops_the_hand_smoothly_and_afterwards_it_is_at_its_goal_again(
    name: str, tmp_path: Path
) -> None:
    trial = faulty(tmp_path, 0, FAULTS[name][0])
    check_limits(trial)
    assert HOLDING[name].beyond(fault_figures(name, trial.log)) == []
    if name != CREEPING:
        assert held_speed(trial.log, AT_S + SECONDS) < STILL_M_S


def test_one_lost_camera_does_not_stop_the_hand(tmp_path: Path) -> None:
    trial = faulty(tmp_path, 0, ONE_LOST)
    check_limits(trial)
    assert one_lost.beyond(one_lost_figures(trial.log)) == []


def test_an_object_that_was_moved_away_is_met_again_from_rest(tmp_path: Path) -> None:
    trial = faulty(tmp_path, 0, MOVED_AWAY, **STILL)
    check_limits(trial)
    assert moved_away.beyond(moved_away_figures(trial.log)) == []


def test_poses_that_are_no_numbers_hold_the_arm(tmp_path: Path) -> None:
    trial = with_no_numbers(tmp_path, 0)
    check_limits(trial)
    figures = held_figures(trial.log, Reason.NOT_FINITE, AT_S + SECONDS)
    assert no_numbers.beyond(figures) == []
    assert held_speed(trial.log, AT_S + SECONDS) < STILL_M_S
    assert isinstance(trial.log.rows[-1].truth, Pose)

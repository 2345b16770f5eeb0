from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from scenes_servo import (
    LAGGING,
    followed_figures,
    lag_figures,
    lost_images,
    servo_followed,
    servo_from_afar,
    servo_lagging,
    servo_one_look,
    trial_figures,
)
from servo_trials import logged, small_trial

from servoid.capture import open_capture
from servoid.cli.servo.servoing import share_of_run
from servoid.errors import ServoError
from servoid.sim.trial import ServoTrial, TrialStep


@pytest.fixture(scope="module")
def steps() -> list[TrialStep]:
    return []


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory, steps: list[TrialStep]) -> ServoTrial:
    """Follow an object that swings to and fro, drawn on one thread."""
    folder = tmp_path_factory.mktemp("followed")
    return small_trial(folder, {"world.threads": 1}, watch=steps.append)


def test_the_object_is_modelled_where_it_is_and_as_it_looks(followed: ServoTrial) -> None:
    assert servo_followed.beyond(trial_figures(followed)) == []


def test_the_object_is_never_lost(followed: ServoTrial) -> None:
    assert len(followed.log.seen) == pytest.approx(90, abs=2)
    assert servo_followed.beyond({"not tracking": lost_images(followed.log)}) == []


def test_the_hand_follows_and_the_eyes_stay_on_the_object(followed: ServoTrial) -> None:
    assert servo_followed.beyond(followed_figures(followed)) == []


def test_no_command_and_no_joint_breaks_a_limit(followed: ServoTrial) -> None:
    joints, log = followed.world.arm.joints, followed.log
    steps = np.abs(np.diff(log.commands, axis=0)) / followed.world.arm.period_s
    assert np.all(steps <= joints.acceleration * (1.0 + 1e-9))
    assert np.all(np.abs(log.commands) <= joints.speed)
    assert np.all((joints.lower < log.positions) & (log.positions < joints.upper))


def test_the_log_has_one_line_for_each_control_period(followed: ServoTrial) -> None:
    times = followed.log.times
    assert np.diff(times) == pytest.approx(followed.world.arm.period_s)
    assert (times[0], times[-1]) == pytest.approx((0.0, 3.0), abs=0.01)


def test_stages_come_in_order_with_what_was_done_and_a_share_of_the_run_that_only_grows(
    followed: ServoTrial, steps: list[TrialStep]
) -> None:
    stages = list(dict.fromkeys(step.stage for step in steps))
    order = ["looking", "looking around", "coming back", "modelling", "servoing", "stopping"]
    assert stages == order
    times = [step.time_s for step in steps]
    assert times == sorted(times)
    assert all(0.0 <= step.share <= 1.0 for step in steps)
    seconds = followed.settings.run.seconds
    shares = [share_of_run(step.stage, step.share, seconds) for step in steps]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert sum(step.row is not None for step in steps) == len(followed.log)
    assert steps[-1].command is not None
    assert not steps[-1].command.velocities.any()


def test_the_arm_rests_while_a_body_is_modelled(
    followed: ServoTrial, steps: list[TrialStep]
) -> None:
    assert followed.exploration.looks
    before = steps[[step.stage for step in steps].index("modelling") - 1]
    assert before.command is not None
    assert not before.command.velocities.any()


def test_what_was_looked_at_lies_in_the_folder_as_a_capture(followed: ServoTrial) -> None:
    capture = open_capture(followed.exploration.capture)
    assert len(capture.all_views()) == 2 * len(followed.exploration.looks) == 4
    assert len(capture.views()) == 1


@pytest.mark.extended
def test_the_same_seed_gives_the_same_log_on_any_number_of_threads(
    followed: ServoTrial, tmp_path: Path
) -> None:
    again = small_trial(tmp_path, {"world.threads": 2, "run.seconds": 1.0})
    first = logged(followed, tmp_path)
    second = logged(again, tmp_path)
    assert len(second) == pytest.approx(125, abs=2)
    assert second == first[: len(second)]


@pytest.mark.extended
def test_without_feed_forward_the_hand_lags_clearly_more(
    followed: ServoTrial, tmp_path: Path
) -> None:
    lagging = small_trial(tmp_path, LAGGING)
    assert servo_lagging.beyond(lag_figures(lagging, followed)) == []


@pytest.mark.extended
def test_a_single_look_is_enough() -> None:
    assert servo_one_look.broken(0) == []


@pytest.mark.extended
def test_a_still_target_is_reached_from_afar_and_turned() -> None:
    assert servo_from_afar.broken(0) == []


@pytest.mark.extended
def test_a_start_out_of_reach_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ServoError, match=r"cannot start 2, 0, 0 m .* choose smaller values"):
        small_trial(tmp_path, {"run.start_offset": [2.0, 0.0, 0.0], "servo.look.count": 1})

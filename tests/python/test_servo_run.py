from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from servo_trials import logged, position_errors, rms, small_trial, turn_errors

from servoid.errors import ServoError
from servoid.observe import open_capture
from servoid.servo import ServoMetrics
from servoid.study import ServoTrial, TrialStep

SETTLED_S = 1.5


@pytest.fixture(scope="module")
def steps() -> list[TrialStep]:
    return []


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory, steps: list[TrialStep]) -> ServoTrial:
    """Follow an object that swings to and fro, drawn on one thread."""
    folder = tmp_path_factory.mktemp("followed")
    return small_trial(folder, {"world.threads": 1}, watch=steps.append)


def test_the_object_is_modelled_where_it_is_and_as_it_looks(followed: ServoTrial) -> None:
    meeting, camera = followed.meeting, followed.world.cameras[0]
    assert np.linalg.norm(followed.truth.object_from_body.translation) < 0.02
    mask = meeting.masks[0]
    assert mask is not None and meeting.masks[1] is None
    drawn = meeting.body.silhouette(camera, meeting.looks[0].world_from_camera[0])
    assert ((mask > 0) & (drawn > 0)).sum() > 0.9 * ((mask > 0) | (drawn > 0)).sum()


def test_the_object_is_never_lost(followed: ServoTrial) -> None:
    statuses = [seen.estimate and seen.estimate.status for _, seen in followed.log.seen]
    assert len(statuses) == pytest.approx(90, abs=2)
    assert set(statuses) == {"tracking"}


def test_the_hand_follows_and_the_eyes_stay_on_the_object(followed: ServoTrial) -> None:
    figures = ServoMetrics.of(followed.log, SETTLED_S)
    assert figures.position_rms < 0.011
    assert figures.turn_rms < np.radians(1.2)
    assert figures.fixation_rms_px < 1.5
    assert sum(hold.seconds for hold in figures.holds if hold.start_s > 0.2) == 0.0


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


def test_stages_come_in_order_and_with_them_what_was_done(
    followed: ServoTrial, steps: list[TrialStep]
) -> None:
    stages = list(dict.fromkeys(step.stage for step in steps))
    order = ["looking", "looking around", "coming back", "modelling", "servoing", "stopping"]
    assert stages == order
    times = [step.time_s for step in steps]
    assert times == sorted(times)
    assert all(0.0 <= step.share <= 1.0 for step in steps)
    assert sum(step.row is not None for step in steps) == len(followed.log)
    assert steps[-1].command is not None
    assert not steps[-1].command.velocities.any()


def test_what_was_looked_at_lies_in_the_folder_as_a_capture(followed: ServoTrial) -> None:
    capture = open_capture(followed.meeting.capture)
    assert len(capture.all_views()) == 2 * len(followed.meeting.looks) == 4
    assert len(capture.views()) == 1


def test_the_same_seed_gives_the_same_log_on_any_number_of_threads(
    followed: ServoTrial, tmp_path: Path
) -> None:
    again = small_trial(tmp_path, {"world.threads": 2, "run.seconds": 1.0})
    first = logged(followed, tmp_path)
    second = logged(again, tmp_path)
    assert len(second) == pytest.approx(125, abs=2)
    assert second == first[: len(second)]


def test_without_feed_forward_the_hand_lags_clearly_more(
    followed: ServoTrial, tmp_path: Path
) -> None:
    lagging = small_trial(tmp_path, {"servo.hand.feed_forward": False})
    lag = rms(position_errors(lagging.log, SETTLED_S))
    assert lag > 2.0 * rms(position_errors(followed.log, SETTLED_S))


def test_a_single_look_is_enough(tmp_path: Path) -> None:
    trial = small_trial(tmp_path, {"servo.look.count": 1})
    assert len(trial.meeting.looks) == 1
    assert all(seen.estimate and seen.estimate.status == "tracking" for _, seen in trial.log.seen)
    assert rms(position_errors(trial.log, SETTLED_S)) < 0.011


def test_a_still_target_is_reached_from_afar_and_turned(tmp_path: Path) -> None:
    start = {"run.start_offset": [0.2, 0.0, 0.0], "run.start_turn_deg": [0.0, 20.0, 0.0]}
    trial = small_trial(tmp_path, {"world.object.path": "still", "run.seconds": 3.0, **start})
    assert position_errors(trial.log)[0] == pytest.approx(0.2, abs=0.02)
    assert turn_errors(trial.log)[0] == pytest.approx(np.radians(20.0), abs=0.02)
    assert rms(position_errors(trial.log, 2.0)) < 0.012
    assert rms(turn_errors(trial.log, 2.0)) < np.radians(1.4)


def test_a_start_out_of_reach_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ServoError, match=r"cannot start 2, 0, 0 m .* choose smaller values"):
        small_trial(tmp_path, {"run.start_offset": [2.0, 0.0, 0.0], "servo.look.count": 1})

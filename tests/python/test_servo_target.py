from collections.abc import Callable

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import WORLD_FROM_OBJECT, to_and_fro

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo.moving import change_between, shifted_and_turned
from servoid.servo.open_turns import OpenTurns
from servoid.servo.settings import TargetSettings
from servoid.servo.target import TargetFilter, Verdict

LATENCY_S = 0.05
NOISE = np.repeat([0.0005, np.radians(0.3)], 3)


def turning(time_s: float) -> Pose:
    """Shift as the paper's target does, and turn about two axes as well."""
    turn = 0.2 * np.sin(0.628 * time_s), 0.3 * np.sin(0.5 * time_s)
    return to_and_fro(10)(time_s) @ Pose.exp([0.0, 0.0, 0.0, *turn, 0.0])


def seen(pose: Pose, time_s: float, noise: np.ndarray = NOISE) -> FakeEstimate:
    return FakeEstimate(time_s, pose, covariance=np.diag(noise**2))


def followed(
    path: Callable[[float], Pose],
    seconds: float = 20,
    seed: int = 0,
    wrong: frozenset[int] = frozenset(),
) -> tuple[TargetFilter, np.ndarray, np.ndarray]:
    """Return the filter, and errors (n, 6) of predicted poses and of their twists after 3 s."""
    random = np.random.default_rng(seed)
    target = TargetFilter(TargetSettings())
    poses, twists = [], []
    for index in range(int(30 * seconds)):
        time_s = index / 30
        change = random.normal(size=6) * NOISE
        if index in wrong:
            change += np.array([0.02, -0.02, 0.01, 0.2, 0.0, 0.1])
        target.update(seen(shifted_and_turned(path(time_s), change), time_s))
        if time_s < 3:
            continue
        for after in (LATENCY_S, LATENCY_S + 0.02):
            now = time_s + after
            prediction = target.predict(now)
            true_twist = change_between(path(now - 1e-4), path(now + 1e-4)) / 2e-4
            poses.append(change_between(path(now), prediction.world_from_object))
            twists.append(prediction.twist - true_twist)
    return target, np.array(poses), np.array(twists)


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


@pytest.mark.parametrize("seed", range(3))
def test_late_and_noisy_estimates_tell_where_the_target_is_now(seed: int) -> None:
    _, poses, twists = followed(turning, seed=seed)
    assert rms(poses[:, :3]) < 1.2e-3
    assert rms(poses[:, 3:]) < np.radians(0.6)
    assert rms(twists[:, :3]) < 0.012
    assert rms(twists[:, 3:]) < np.radians(3)


def test_a_constant_twist_is_predicted_exactly() -> None:
    def path(time_s: float) -> Pose:
        change = np.array([0.1, 0.02, -0.03, 0.3, 0.0, 0.0]) * time_s
        return shifted_and_turned(WORLD_FROM_OBJECT, change)

    target = TargetFilter(TargetSettings())
    for index in range(300):
        target.update(seen(path(index / 30), index / 30))
    prediction = target.predict(299 / 30 + 0.1)
    error = change_between(path(299 / 30 + 0.1), prediction.world_from_object)
    np.testing.assert_allclose(error, 0, atol=1e-5)
    np.testing.assert_allclose(prediction.twist, [0.1, 0.02, -0.03, 0.3, 0, 0], atol=1e-4)


def test_single_wrong_estimates_hardly_count() -> None:
    right = rms(followed(turning)[1])
    wrong = rms(followed(turning, wrong=frozenset(range(100, 600, 60)))[1])
    assert wrong < 1.1 * right


def test_an_estimate_that_cannot_be_is_left_out() -> None:
    target = followed(turning, 5)[0]
    time_s = 5.0
    before = target.predict(time_s).world_from_object.matrix()
    away = shifted_and_turned(turning(time_s), np.array([0.3, 0, 0, 0, 0, 0]))
    assert target.update(seen(away, time_s)) is Verdict.TELEPORT
    assert np.array_equal(target.predict(time_s).world_from_object.matrix(), before)


def test_several_estimates_that_agree_are_believed() -> None:
    target = followed(turning, 5)[0]
    verdicts = []
    for index in range(150, 160):
        away = shifted_and_turned(turning(index / 30), np.array([0.3, 0, 0, 0, 0, 0]))
        verdicts.append(target.update(seen(away, index / 30)))
    agreeing = TargetSettings().agreeing
    expected = [Verdict.TELEPORT] * (agreeing - 1) + [Verdict.RESTARTED]
    assert verdicts == expected + [Verdict.USED] * (10 - agreeing)


def test_estimates_out_of_order_are_left_out() -> None:
    target = followed(turning, 5)[0]
    assert target.update(seen(turning(2.0), 2.0)) is Verdict.OUTDATED


def test_what_the_tracker_is_unsure_of_moves_the_filter_little() -> None:
    moved = []
    for spin in (0.005, 1.0):
        target = TargetFilter(TargetSettings())
        noise = np.array([0.0005, 0.0005, 0.0005, 0.005, 0.005, spin])
        for index in range(60):
            target.update(seen(WORLD_FROM_OBJECT, index / 30, noise))
        spun = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, 0.02])
        for index in range(60, 64):
            target.update(seen(spun, index / 30, noise))
        change = change_between(WORLD_FROM_OBJECT, target.predict(63 / 30).world_from_object)
        moved.append(float(np.linalg.norm(change[3:])))
    assert moved[1] < 0.5 * moved[0]


def test_a_spin_that_images_do_not_tell_is_left_as_it_was() -> None:
    def drifting(time_s: float) -> Pose:
        return turning(time_s) @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, 0.4 * time_s])

    target = TargetFilter(TargetSettings())
    for index in range(300):
        estimate = seen(drifting(index / 30), index / 30)
        estimate.unobservable = np.array([[0.0, 0.02, 0.0, 0.0, 0.0, 1.0]])
        assert target.update(estimate) is Verdict.USED
    now = 299 / 30
    prediction = target.predict(now)
    error = change_between(prediction.world_from_object, drifting(now))
    np.testing.assert_allclose(error[:3], 0, atol=1e-3)
    # The bottle's axis is where it should be, the mark on it has not gone round.
    axis = prediction.world_from_object.matrix()[:3, 2]
    assert axis @ drifting(now).matrix()[:3, 2] > np.cos(np.radians(0.5))
    spun = (turning(now).inverse() @ prediction.world_from_object).log()[5]
    assert abs(spun) < 0.15
    assert abs(prediction.twist[3:] @ axis) < 0.03


@pytest.mark.parametrize("spin", [-3.0, -1.5, 0.4, 2.2])
@pytest.mark.parametrize("forgotten", [True, False])
def test_an_object_that_is_found_again_keeps_the_spin_that_images_do_not_tell(
    spin: float, forgotten: bool
) -> None:
    bottle = np.array([[0.0, 0.02, 0.0, 0.0, 0.0, 1.0]])
    target = TargetFilter(TargetSettings())
    target.update(seen(WORLD_FROM_OBJECT, 0.0))
    if forgotten:
        target.forget()
    moved = shifted_and_turned(WORLD_FROM_OBJECT, np.array([0.3, 0.2, 0.1, 0.2, -0.1, 0.1]))
    for index in range(1, 7):
        estimate = seen(moved @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, spin]), 0.03 * index)
        estimate.unobservable = bottle
        target.update(estimate)
    change = WORLD_FROM_OBJECT.inverse() @ target.predict(0.2).world_from_object
    np.testing.assert_allclose(
        target.predict(0.18).world_from_object.translation, moved.translation, atol=1e-3
    )
    assert change.log()[5] == pytest.approx(0.0, abs=0.02)
    axis = target.predict(0.18).world_from_object.matrix()[:3, 2]
    assert axis @ moved.matrix()[:3, 2] > np.cos(np.radians(0.5))


def test_a_turn_that_images_tell_badly_does_not_lead_the_hand_astray() -> None:
    target = TargetFilter(TargetSettings())
    noise = np.array([0.0003, 0.0003, 0.001, 0.03, 0.02, 0.003])
    errors = []
    for index in range(300):
        time_s = index / 30
        astray = 0.1 * np.sin(2.0 * time_s), 0.08 * np.sin(1.5 * time_s), 0.0
        wrong = to_and_fro(10)(time_s) @ Pose.exp([0.0, 0.0, 0.0, *astray])
        assert target.update(seen(wrong, time_s, noise)) is Verdict.USED
        predicted = target.predict(time_s).world_from_object
        errors.append(change_between(to_and_fro(10)(time_s), predicted))
    assert rms(np.array(errors)[:, 3:]) < np.radians(0.3)
    assert rms(np.array(errors)[:, :3]) < 1e-3


def test_a_turn_that_is_told_well_is_followed_beside_one_that_is_not() -> None:
    target = TargetFilter(TargetSettings())
    noise = np.array([0.0003, 0.0003, 0.001, 0.03, 0.002, 0.002])

    def path(time_s: float) -> Pose:
        return WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, 0.2 * np.sin(time_s)])

    for index in range(300):
        target.update(seen(path(index / 30), index / 30, noise))
    now = 299 / 30
    error = change_between(path(now), target.predict(now).world_from_object)
    np.testing.assert_allclose(error, 0.0, atol=0.01)


def test_a_turn_that_is_told_for_a_moment_does_not_throw_the_object_about() -> None:
    target = TargetFilter(TargetSettings())
    errors = []
    for index in range(300):
        unsure = np.repeat([0.0005, 0.009 if 200 <= index < 203 else 0.03], 3)
        astray = 0.05 + 0.02 * (-1) ** index
        wrong = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, astray if index else 0.0, 0.0, 0.0])
        target.update(seen(wrong, index / 30, unsure))
        predicted = target.predict(index / 30 + LATENCY_S).world_from_object
        errors.append(change_between(WORLD_FROM_OBJECT, predicted)[3:])
    assert np.abs(errors[:200]).max() < 1e-6
    assert np.abs(errors[200:]).max() < 0.05


def test_an_axis_that_is_named_twice_is_one_axis() -> None:
    estimate = seen(WORLD_FROM_OBJECT, 0.0, np.array([0.001, 0.001, 0.001, 0.5, 0.002, 0.002]))
    estimate.unobservable = np.array([[0.0, 0.0, 0.0, 0.998, 0.06, 0.0]])
    assert OpenTurns.of(estimate, 0.01).axes.shape == (3, 1)


def test_an_object_whose_turns_are_all_open_is_not_turned() -> None:
    target = TargetFilter(TargetSettings())
    for index in range(100):
        pose = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, *(0.02 * index * np.ones(3))])
        estimate = seen(pose, index / 30)
        estimate.unobservable = np.hstack([np.zeros((3, 3)), np.eye(3)])
        target.update(estimate)
    change = change_between(WORLD_FROM_OBJECT, target.predict(99 / 30).world_from_object)
    np.testing.assert_allclose(change, 0, atol=1e-9)


def test_beyond_the_horizon_a_prediction_stands_still() -> None:
    target = followed(turning, 5)[0]
    horizon_s = TargetSettings().horizon_s
    last_s = target.time_s
    assert last_s is not None
    far, farther = (target.predict(last_s + horizon_s + more) for more in (0.5, 5.0))
    assert np.array_equal(far.world_from_object.matrix(), farther.world_from_object.matrix())
    assert not np.any(far.twist)


def test_without_compensation_the_target_is_where_the_last_image_showed_it() -> None:
    target = TargetFilter(TargetSettings(compensate=False))
    for index in range(60):
        time_s = index / 30
        target.update(seen(to_and_fro(10)(time_s), time_s))
    last_s = target.time_s
    assert last_s is not None
    now, soon = (target.predict(last_s + after) for after in (0.0, 0.1))
    assert np.array_equal(now.world_from_object.matrix(), soon.world_from_object.matrix())
    assert np.array_equal(now.twist, soon.twist)
    assert np.linalg.norm(now.twist) > 0.0


def test_a_filter_without_estimates_predicts_nothing() -> None:
    with pytest.raises(ServoError, match="no estimate has come yet"):
        TargetFilter(TargetSettings()).predict(0.0)

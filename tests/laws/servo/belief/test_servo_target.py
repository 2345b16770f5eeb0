from collections.abc import Callable

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from servo_loop import WORLD_FROM_OBJECT, to_and_fro
from tiers import tiered

from servoid._native import change_between, shifted_and_turned
from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo.belief.jumps import GateResult
from servoid.servo.belief.target import TargetFilter
from servoid.servo.belief.unobservable_turns import UnobservableTurns
from servoid.servo.settings import TargetSettings

LATENCY_S = 0.05
NOISE = np.repeat([0.0005, np.radians(0.3)], 3)


def turning(time_s: float) -> Pose:
    """Shift as the paper's target does, and turn about two axes as well."""
    turn = 0.2 * np.sin(0.628 * time_s), 0.3 * np.sin(0.5 * time_s)
    return to_and_fro(10)(time_s) @ Pose.exp([0.0, 0.0, 0.0, *turn, 0.0])


def seen(
    pose: Pose, time_s: float, noise: np.ndarray = NOISE, confidence: float = 1.0
) -> FakeEstimate:
    return FakeEstimate(time_s, pose, confidence=confidence, covariance=np.diag(noise**2))


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
    # 1.8 mm and 24 mm/s, more than of a filter that is told how slow this motion is, 1.1 and 11:
    # one that is quick enough for faster motion heeds each estimate more.
    assert rms(poses[:, :3]) < 2.3e-3
    assert rms(poses[:, 3:]) < np.radians(0.6)
    assert rms(twists[:, :3]) < 0.03
    assert rms(twists[:, 3:]) < np.radians(3)


def test_a_constant_twist_is_predicted() -> None:
    def path(time_s: float) -> Pose:
        change = np.array([0.1, 0.02, -0.03, 0.3, 0.0, 0.0]) * time_s
        return shifted_and_turned(WORLD_FROM_OBJECT, change)

    target = TargetFilter(TargetSettings())
    for index in range(300):
        target.update(seen(path(index / 30), index / 30))
    prediction = target.predict(299 / 30 + 0.1)
    error = change_between(path(299 / 30 + 0.1), prediction.world_from_object)
    # Not to the last digit: that it may have come to rest is never ruled out.
    np.testing.assert_allclose(error, 0, atol=1.5e-4)
    np.testing.assert_allclose(prediction.twist, [0.1, 0.02, -0.03, 0.3, 0, 0], atol=1e-3)


def test_single_wrong_estimates_hardly_count() -> None:
    right = rms(followed(turning)[1])
    wrong = rms(followed(turning, wrong=frozenset(range(100, 600, 60)))[1])
    assert wrong < 1.2 * right  # 1.14: it is quicker to follow them than a slow filter


def test_an_estimate_that_cannot_be_is_left_out() -> None:
    target = followed(turning, 5)[0]
    time_s = 5.0
    before = target.predict(time_s).world_from_object.matrix()
    away = shifted_and_turned(turning(time_s), np.array([0.3, 0, 0, 0, 0, 0]))
    assert target.update(seen(away, time_s)) is GateResult.TELEPORT
    assert np.array_equal(target.predict(time_s).world_from_object.matrix(), before)


def test_several_estimates_that_agree_are_believed() -> None:
    target = followed(turning, 5)[0]
    verdicts = []
    for index in range(150, 160):
        away = shifted_and_turned(turning(index / 30), np.array([0.3, 0, 0, 0, 0, 0]))
        verdicts.append(target.update(seen(away, index / 30)))
    agreeing = TargetSettings().agreeing
    expected = [GateResult.TELEPORT] * (agreeing - 1) + [GateResult.RESTARTED]
    assert verdicts == expected + [GateResult.USED] * (10 - agreeing)


def test_estimates_out_of_order_are_left_out() -> None:
    target = followed(turning, 5)[0]
    assert target.update(seen(turning(2.0), 2.0)) is GateResult.OUTDATED


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
        assert target.update(estimate) is GateResult.USED
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


def astray(time_s: float) -> Pose:
    """Return by what the turn of an object without print is wrong: slowly, now here, now there."""
    return Pose.exp([0.0, 0.0, 0.0, 0.1 * np.sin(2 * time_s), 0.08 * np.sin(1.5 * time_s), 0.0])


@pytest.mark.parametrize("confidence", [0.3, 0.6])
def test_a_turn_that_the_tracker_doubts_leads_the_hand_less_astray_than_it_errs(
    confidence: float,
) -> None:
    target = TargetFilter(TargetSettings())
    noise = np.array([0.0003, 0.0003, 0.001, 0.03, 0.02, 0.003])
    errors, wrong = [], []
    for index in range(600):
        time_s = index / 30
        true = to_and_fro(10)(time_s)
        estimate = seen(true @ astray(time_s), time_s, noise, confidence)
        assert target.update(estimate) is GateResult.USED
        errors.append(change_between(true, target.predict(time_s).world_from_object))
        wrong.append(change_between(true, estimate.world_from_object))
    assert rms(np.array(errors)[:, 3:]) < 0.6 * rms(np.array(wrong)[:, 3:])
    assert rms(np.array(errors)[:, :3]) < 1e-3


@pytest.mark.parametrize("confidence", [0.95, 1.0])
def test_a_turn_that_is_told_is_followed_within_a_second(confidence: float) -> None:
    target = TargetFilter(TargetSettings())
    noise = np.array([0.0003, 0.0003, 0.001, 0.02, 0.02, 0.02])
    turned = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, 0.1, -0.2, 0.1])
    for index in range(90):
        pose = WORLD_FROM_OBJECT if index < 60 else turned
        target.update(seen(pose, index / 30, noise, confidence))
    error = change_between(turned, target.predict(89 / 30).world_from_object)
    assert np.linalg.norm(error[3:]) < 0.25 * np.linalg.norm([0.1, -0.2, 0.1])


@given(
    turn=st.tuples(*[st.floats(-0.25, 0.25)] * 3),
    doubted=st.lists(st.floats(0.1, 1.0), min_size=20, max_size=20),
    confidence=st.floats(0.1, 1.0),
)
@settings(max_examples=8, deadline=None, phases=[Phase.explicit, Phase.generate])
def test_any_constant_estimate_is_reached_in_the_limit_whatever_came_before(
    turn: tuple[float, float, float], doubted: list[float], confidence: float
) -> None:
    target = TargetFilter(TargetSettings())
    for index, confidence in enumerate(doubted):
        target.update(seen(WORLD_FROM_OBJECT @ astray(index / 30), index / 30, NOISE, confidence))
    there, time_s = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, *turn]), 0.0
    noise = np.repeat([0.0005, 0.05], 3)
    for index in range(200):
        time_s = 1.0 + 5.0 * index
        target.update(seen(there, time_s, noise, confidence))
    error = change_between(there, target.predict(time_s).world_from_object)
    assert np.linalg.norm(error[3:]) < 0.02


@pytest.mark.parametrize("seed", tiered(range(4)))
def test_belief_is_as_far_off_as_it_says_though_successive_estimates_err_alike(seed: int) -> None:
    random, target_settings = np.random.default_rng(seed), TargetSettings()
    sigma = np.repeat([0.0006, 0.012], 3)
    fades = np.exp(-1 / 30 / 0.3)
    squared = []
    for _ in range(3):
        target, lasting = TargetFilter(target_settings), random.normal(size=6)
        for index in range(240):
            lasting = fades * lasting + np.sqrt(1 - fades**2) * random.normal(size=6)
            fresh = np.sqrt(target_settings.fresh) * random.normal(size=6)
            error = sigma * (np.sqrt(1 - target_settings.fresh) * lasting + fresh)
            true = turning(index / 30)
            turned = true @ Pose.exp([0.0, 0.0, 0.0, *error[3:]])
            shifted = np.concatenate([true.matrix()[:3, :3] @ error[:3], np.zeros(3)])
            target.update(seen(shifted_and_turned(turned, shifted), index / 30, sigma))
            if index >= 30 and index % 5 == 0:
                now = target.predict(index / 30 + LATENCY_S)
                off = change_between(turning(now.time_s), now.world_from_object)
                squared.append(off @ np.linalg.solve(now.covariance, off) / 6)
    assert 0.2 < np.mean(squared) < 1.2


def test_a_turn_that_was_doubted_is_put_right_soon_after_the_tracker_is_sure() -> None:
    target = TargetFilter(TargetSettings())
    wrong = WORLD_FROM_OBJECT @ Pose.exp([0.0, 0.0, 0.0, 0.1, -0.2, 0.1])
    for index in range(90):
        pose, confidence = (wrong, 0.4) if index < 30 else (WORLD_FROM_OBJECT, 1.0)
        target.update(seen(pose, index / 30, NOISE, confidence))
    error = change_between(WORLD_FROM_OBJECT, target.predict(3.0).world_from_object)
    assert np.linalg.norm(error[3:]) < 0.02


def test_belief_knows_less_the_longer_nothing_was_seen() -> None:
    target = followed(turning, 5)[0]
    last_s = target.time_s
    assert last_s is not None
    later = (0.0, 0.05, 0.1, 0.2)
    spreads = [np.trace(target.predict(last_s + after).covariance) for after in later]
    assert spreads == sorted(spreads)
    assert spreads[-1] > 2 * spreads[0]


def test_a_prediction_is_known_the_less_the_farther_from_the_object() -> None:
    prediction = followed(turning, 5)[0].predict(5.0)
    away = np.array([1.0, 2.0, -1.0])
    spreads = [prediction.spread_at(prediction.place + length * away) for length in (0, 0.1, 0.5)]
    assert spreads[0] == pytest.approx(np.sqrt(np.trace(prediction.covariance[:3, :3])))
    assert spreads == sorted(spreads)


def test_frames_of_the_world_change_nothing() -> None:
    frame = Pose.exp([0.4, -1.0, 0.3, 0.5, -1.2, 0.8])
    here, there = TargetFilter(TargetSettings()), TargetFilter(TargetSettings())
    random = np.random.default_rng(2)
    noise = np.array([0.0003, 0.0004, 0.001, 0.02, 0.01, 0.003])
    for index in range(60):
        pose = turning(index / 30) @ Pose.exp((random.normal(size=6) * noise).tolist())
        here.update(seen(pose, index / 30, noise, 0.9))
        there.update(seen(frame @ pose, index / 30, noise, 0.9))
    one, other = here.predict(2.0), there.predict(2.0)
    difference = change_between(frame @ one.world_from_object, other.world_from_object)
    np.testing.assert_allclose(difference, 0, atol=1e-9)
    turn = np.kron(np.eye(2), frame.matrix()[:3, :3])
    np.testing.assert_allclose(turn @ one.twist, other.twist, atol=1e-9)
    np.testing.assert_allclose(turn @ one.covariance @ turn.T, other.covariance, atol=1e-9)


def test_the_same_estimates_give_the_same_bits() -> None:
    once, again = (followed(turning, 4, seed=3)[1] for _ in range(2))
    assert np.array_equal(once, again)


def test_jumps_are_counted_once_and_until_one_is_believed() -> None:
    target = followed(turning, 5)[0]
    counts = []
    for index in range(150, 157):
        away = shifted_and_turned(turning(index / 30), np.array([0.3, 0, 0, 0, 0, 0]))
        target.update(seen(away, index / 30))
        counts.append(target.jumps)
    agreeing = TargetSettings().agreeing
    assert counts == [*range(1, agreeing), 0, 0, 0]


def test_jumps_that_contradict_each_other_are_all_counted_and_none_believed() -> None:
    target = followed(turning, 5)[0]
    for index in range(150, 160):
        aside = np.array([0.6 if index % 2 else -0.6, 0, 0, 0, 0, 0])
        away = shifted_and_turned(turning(5.0), aside)
        assert target.update(seen(away, index / 30)) is GateResult.TELEPORT
    assert target.jumps == 10


def test_an_axis_that_is_named_twice_is_one_axis() -> None:
    estimate = seen(WORLD_FROM_OBJECT, 0.0)
    alike = [[0.0, 0.0, 0.0, 0.998, 0.06, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]]
    estimate.unobservable = np.array(alike)
    assert UnobservableTurns.of(estimate).axes.shape == (3, 1)


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


def test_before_the_newest_images_the_object_is_where_they_showed_it() -> None:
    target = TargetFilter(TargetSettings())
    for index in range(30):
        time_s = index / 30
        target.update(seen(to_and_fro(10)(time_s), time_s))
    now, before = target.predict(29 / 30), target.predict(29 / 30 - 0.2)
    assert np.allclose(before.world_from_object.matrix(), now.world_from_object.matrix())
    assert np.isfinite(before.spread_at(np.ones(3)))

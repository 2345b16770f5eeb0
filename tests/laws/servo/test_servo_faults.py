"""Faults are put into a closed loop: the arm comes to rest smoothly, and goes on afterwards."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import (
    RATE_HZ,
    Loop,
    Seen,
    Tick,
    broken_limits,
    position_errors,
    to_and_fro,
)
from tiers import tiered

from servoid._native import change_between, shifted_and_turned
from servoid.pose import Pose
from servoid.servo import GazeMode, Reason, ServoSettings
from servoid.servo.belief.target import TargetFilter
from servoid.servo.keeping.safety import SafetySupervisor
from servoid.servo.settings import GazeSettings, SafetySettings, TargetSettings
from servoid.source.source import Instant

FIRST_S, LAST_S = 4.0, 6.0
AWAY = np.array([0.0, 0.25, 0.1, 0.0, 0.0, 0.0])


WRONG = np.array([0.03, 0.0, 0.04, 0.0, 0.0, 0.0])  # 50 mm


@dataclass
class NotFinite:
    """A pose that another tracker than ours may report."""

    def matrix(self) -> np.ndarray:
        return np.full((4, 4), np.nan)


def dropped(_instant: Instant, _estimate: FakeEstimate) -> Seen:
    return None, None


def dark(instant: Instant, _estimate: FakeEstimate) -> Seen:
    return replace(instant, images=(None, None)), None


def occluded(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.confidence = 0.1
    return instant, estimate


def lost(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.status = "lost"
    return instant, estimate


def searching(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.status, estimate.confidence = "searching", 0.6
    return instant, estimate


def frozen(instant: Instant, estimate: FakeEstimate) -> Seen:
    image = np.full((8, 8, 3), 7, np.uint8)
    return replace(instant, images=(image, instant.images[1])), estimate


def not_finite(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.world_from_object = NotFinite()  # type: ignore[assignment]
    return instant, estimate


def ahead(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.time_s += 1e3
    return replace(instant, time_s=estimate.time_s), estimate


def unsure_by_nan(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.confidence = float("nan")
    return instant, estimate


def erratic(instant: Instant, estimate: FakeEstimate) -> Seen:
    aside = AWAY * (1 if instant.index % 2 else -1)
    estimate.world_from_object = shifted_and_turned(estimate.world_from_object, aside)
    return instant, estimate


FAULTS: dict[Callable[[Instant, FakeEstimate], Seen], Reason] = {
    dropped: Reason.NO_IMAGES,
    dark: Reason.NO_IMAGES,
    occluded: Reason.UNSURE,
    lost: Reason.LOST,
    searching: Reason.SEARCHING,
    frozen: Reason.FROZEN,
    ahead: Reason.AHEAD,
    not_finite: Reason.NOT_FINITE,
    unsure_by_nan: Reason.NOT_FINITE,
    erratic: Reason.TELEPORT,
}


def during(fault: Callable[[Instant, FakeEstimate], Seen], last_s: float = LAST_S) -> Loop:
    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        return (
            fault(instant, estimate) if FIRST_S <= instant.time_s < last_s else (instant, estimate)
        )

    return Loop(to_and_fro(10), spoil=spoil)


def stepped(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.world_from_object = shifted_and_turned(estimate.world_from_object, WRONG)
    estimate.confidence = 0.7
    return instant, estimate


def drifting(instant: Instant, estimate: FakeEstimate) -> Seen:
    gone = min(1.0, (instant.time_s - FIRST_S) / 1.5) * WRONG
    estimate.world_from_object = shifted_and_turned(estimate.world_from_object, gone)
    estimate.confidence = 0.7
    return instant, estimate


def zigzagging(instant: Instant, estimate: FakeEstimate) -> Seen:
    """Have each estimate where the object could be, but no two of them together."""
    aside = (1 if instant.index % 2 else -1) * 0.5 * WRONG
    estimate.world_from_object = shifted_and_turned(estimate.world_from_object, aside)
    return instant, estimate


def between(ticks: list[Tick], first_s: float, last_s: float) -> list[Tick]:
    return [tick for tick in ticks if first_s <= tick.time_s < last_s]


def hand_speeds(ticks: list[Tick]) -> np.ndarray:
    return np.array([np.linalg.norm(tick.hand_twist[:3]) for tick in ticks])


def hand_accelerations(loop: Loop, ticks: list[Tick]) -> np.ndarray:
    twists = np.array([tick.hand_twist[:3] for tick in ticks])
    return np.linalg.norm(np.diff(twists, axis=0), axis=1) / loop.arm.period_s


@pytest.mark.parametrize("fault", tiered(FAULTS, 3), ids=lambda fault: fault.__name__)
def test_a_fault_brings_the_arm_to_rest_smoothly_and_afterwards_it_goes_on(
    fault: Callable[[Instant, FakeEstimate], Seen],
) -> None:
    loop = during(fault)
    ticks = loop.run(10)
    resting = between(ticks, FIRST_S + 1.0, LAST_S)
    assert hand_speeds(between(ticks, FIRST_S - 0.1, FIRST_S)).min() > 0.03
    assert hand_speeds(resting).max() < 1e-4
    reasons = frozenset[Reason]().union(*(tick.command.holding for tick in resting))
    assert FAULTS[fault] in reasons
    # What jumps to and fro is believed for an image where it could have been by then.
    assert reasons - {FAULTS[fault]} <= (
        {Reason.RETURNING} if fault is erratic else {Reason.NO_IMAGES}
    )
    assert broken_limits(loop) == []
    calm = hand_accelerations(loop, between(ticks, 1.5, FIRST_S)).max()
    assert hand_accelerations(loop, between(ticks, FIRST_S, 10)).max() < max(5.0, 2 * calm)
    assert position_errors(ticks[-100:]).max() < 5e-3
    assert not ticks[-1].command.holding


@pytest.mark.parametrize("fault", [stepped, drifting], ids=lambda fault: fault.__name__)
def test_a_wrong_pose_of_which_the_tracker_is_not_sure_ends_held_and_told(
    fault: Callable[[Instant, FakeEstimate], Seen],
) -> None:
    ticks = during(fault).run(LAST_S)
    resting = between(ticks, FIRST_S + 1.0, LAST_S)
    assert all(Reason.UNSURE in tick.command.holding for tick in resting)
    assert hand_speeds(resting).max() < 1e-4


def test_what_is_seen_and_what_is_believed_may_not_be_apart_for_long_however_sure() -> None:
    ticks = during(zigzagging).run(LAST_S)
    parted_s = SafetySettings().parted_s
    first_reported_s = next(t.time_s for t in ticks if Reason.PARTED in t.command.limiting)
    first_held = next(t.time_s for t in ticks if Reason.PARTED in t.command.holding)
    assert first_reported_s - FIRST_S == pytest.approx(parted_s, abs=0.2)
    assert first_held - FIRST_S == pytest.approx(2 * parted_s, abs=0.3)
    assert hand_speeds(between(ticks, FIRST_S, LAST_S)).max() < 0.4


def test_a_single_odd_estimate_is_not_told() -> None:
    def once(instant: Instant, estimate: FakeEstimate) -> Seen:
        return zigzagging(instant, estimate)

    ticks = during(once, last_s=FIRST_S + 0.02).run(6)
    assert not any(Reason.PARTED in t.command.limiting | t.command.holding for t in ticks)


def test_a_goal_that_is_told_roughly_is_approached_and_said_to_be_rough() -> None:
    def rough(instant: Instant, estimate: FakeEstimate) -> Seen:
        if instant.time_s >= FIRST_S:
            estimate.covariance = np.diag(np.repeat([1e-3, 0.1], 3) ** 2)
        return instant, estimate

    ticks = Loop(to_and_fro(10), spoil=rough).run(LAST_S)
    reported = [Reason.ROUGH in tick.command.limiting for tick in between(ticks, 2.0, FIRST_S)]
    late = [Reason.ROUGH in tick.command.limiting for tick in between(ticks, 5.0, LAST_S)]
    assert not any(reported)
    assert all(late)
    assert all(not tick.command.holding for tick in between(ticks, 2.0, LAST_S))


@pytest.mark.parametrize("seed", tiered(range(3)))
def test_after_a_hold_the_turn_comes_from_the_mean_of_many_estimates(seed: int) -> None:
    random = np.random.default_rng(seed)

    def scattered(instant: Instant, estimate: FakeEstimate) -> Seen:
        if instant.time_s < FIRST_S + 1.0:
            return lost(instant, estimate)
        error = np.concatenate([np.zeros(3), 0.05 * random.normal(size=3)])
        estimate.world_from_object = shifted_and_turned(estimate.world_from_object, error)
        estimate.covariance = np.diag(np.repeat([1e-3, 0.15], 3) ** 2)
        return instant, estimate

    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        return (instant, estimate) if instant.time_s < FIRST_S else scattered(instant, estimate)

    loop = Loop(to_and_fro(1e9), spoil=spoil)
    ticks = loop.run(FIRST_S + 3.0)
    moving = [t for t in between(ticks, FIRST_S + 1.0, 9.0) if not t.command.holding]
    believed = moving[0].command.world_from_object
    assert believed is not None
    off = change_between(loop.path(0.0), believed)[3:]
    assert np.linalg.norm(off) < 0.05  # of 0.087, what a single one errs by


def test_eyes_rest_with_the_arm_while_the_target_is_lost() -> None:
    resting = between(during(lost).run(6), FIRST_S + 1.5, LAST_S)
    assert max(np.abs(tick.state.velocities).max() for tick in resting) < 1e-3


def test_a_single_wrong_estimate_is_not_noticed_by_the_hand() -> None:
    quiet = Loop(to_and_fro(10)).run(6)
    loop = during(erratic, last_s=FIRST_S + 0.02)
    ticks = loop.run(6)
    assert all(not tick.command.holding for tick in between(ticks, 1, 6))
    assert np.abs(position_errors(ticks) - position_errors(quiet)).max() < 5e-4


def test_a_short_gap_is_bridged_by_the_prediction() -> None:
    ticks = during(dropped, last_s=FIRST_S + 0.1).run(6)
    assert all(not tick.command.holding for tick in between(ticks, 1, 6))
    assert position_errors(between(ticks, 3, 6)).max() < 5e-3


@pytest.mark.extended
def test_a_target_that_was_moved_away_is_approached_from_rest() -> None:
    def moved(instant: Instant, estimate: FakeEstimate) -> Seen:
        if instant.time_s >= FIRST_S:
            estimate.world_from_object = shifted_and_turned(estimate.world_from_object, 0.5 * AWAY)
        return instant, estimate

    loop = Loop(to_and_fro(1e9), spoil=moved)
    ticks = loop.run(10)
    holding = [tick.time_s for tick in between(ticks, FIRST_S, 10) if tick.command.holding]
    assert 0.1 < len(holding) * loop.arm.period_s < 1.0
    shift = ticks[-1].error[:3]
    np.testing.assert_allclose(shift, 0.5 * AWAY[:3], atol=1e-3)
    assert hand_speeds(between(ticks, FIRST_S, 10)).max() <= 0.5
    assert broken_limits(loop) == []


@pytest.mark.extended
def test_a_plain_bottle_that_is_found_again_with_another_spin_does_not_move_the_hand() -> None:
    def spun(instant: Instant, estimate: FakeEstimate) -> Seen:
        estimate.unobservable = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
        if FIRST_S <= instant.time_s < FIRST_S + 1.0:
            return lost(instant, estimate)
        if instant.time_s >= FIRST_S:
            spin = Pose.exp([0.0, 0.0, 0.0, 0.0, 2.0, 0.0])
            estimate.world_from_object = estimate.world_from_object @ spin
        return instant, estimate

    ticks = Loop(to_and_fro(1e9), spoil=spun).run(FIRST_S + 3.0)
    assert any(tick.command.holding for tick in between(ticks, FIRST_S, 9.0))
    assert not ticks[-1].command.holding
    assert position_errors(between(ticks, FIRST_S, 9.0)).max() < 5e-3


@pytest.mark.parametrize("guesses", tiered([1, 4, 9]))
def test_wrong_guesses_about_a_hidden_target_do_not_turn_the_eyes_away_for_good(
    guesses: int,
) -> None:
    def guessed(instant: Instant, estimate: FakeEstimate) -> Seen:
        hidden_s = instant.time_s - FIRST_S
        if hidden_s < 0:
            return instant, estimate
        if 1.0 <= hidden_s < 1.0 + (guesses - 0.5) / RATE_HZ:
            estimate.world_from_object = shifted_and_turned(estimate.world_from_object, AWAY)
            return instant, estimate
        return lost(instant, estimate)

    loop = Loop(to_and_fro(1e9), spoil=guessed)
    ticks = loop.run(FIRST_S + 3.0)
    rested = ServoSettings().safety.resume_after
    if guesses < rested:
        assert max(tick.fixation for tick in between(ticks, FIRST_S, 9.0)) < np.radians(1.0)
    assert ticks[-1].fixation < np.radians(3.0)
    assert broken_limits(loop) == []


def test_a_camera_that_hangs_stays_untrusted_while_the_arm_rests() -> None:
    resting = between(during(frozen, last_s=9.0).run(9), FIRST_S + 1.5, 9.0)
    assert all(Reason.FROZEN in tick.command.holding for tick in resting)


def test_equal_images_of_cameras_at_rest_are_no_fault() -> None:
    def same(instant: Instant, estimate: FakeEstimate) -> Seen:
        image = np.zeros((8, 8, 3), np.uint8)
        return replace(instant, images=(image, image)), estimate

    settings = ServoSettings(gaze=GazeSettings(mode=GazeMode.PARALLEL))
    loop = Loop(to_and_fro(1e9), settings, spoil=same, goal=lambda _: None)
    loop.run(1)
    late = loop.run(2)
    assert all(
        not tick.command.holding for tick in late if np.abs(tick.state.velocities).max() < 1e-6
    )


def test_nothing_moves_before_a_target_was_seen() -> None:
    loop = Loop(to_and_fro(10), spoil=dropped)
    ticks = loop.run(1)
    assert all(Reason.NO_TARGET in tick.command.holding for tick in ticks)
    assert all(not np.any(tick.command.velocities) for tick in ticks)


def test_images_that_stop_are_all_that_is_said_to_be_wrong() -> None:
    trust = SafetySupervisor(SafetySettings(), TargetFilter(TargetSettings()))
    for index in range(20):
        trust.see(None, FakeEstimate(index / 30, Pose.identity()))
        trust.advance(index / 30)
    trust.advance(0.8)
    assert trust.holding() == trust.holding() == frozenset()
    trust.advance(1.2)
    assert trust.holding() == {Reason.NO_IMAGES}


def test_images_that_only_the_tracker_has_are_not_said_to_be_missing() -> None:
    trust = SafetySupervisor(SafetySettings(), TargetFilter(TargetSettings()))
    for index in range(20):
        lost = FakeEstimate(index / 30, Pose.identity(), status="searching")
        trust.see(None, lost)
        trust.advance(index / 30)
        assert trust.holding() == {Reason.NO_TARGET, Reason.SEARCHING}
    trust.advance(1.2)
    assert trust.holding() == {Reason.NO_TARGET, Reason.SEARCHING, Reason.NO_IMAGES}


def test_joint_states_that_are_no_numbers_brake_the_arm() -> None:
    loop = Loop(to_and_fro(10))
    loop.run(3)
    state = loop.arm.state()
    state.positions[2] = np.nan
    last = loop.ticks[-1].command.velocities
    speeds = []
    for _ in range(200):
        command = loop.controller.command(state, Pose.identity())
        assert command.holding == {Reason.BAD_STATE}
        change = np.abs(command.velocities - last) / loop.arm.period_s
        assert np.all(change <= loop.arm.joints.acceleration)
        last = command.velocities
        speeds.append(np.abs(last).max())
    assert speeds[0] > 0 and speeds[-1] == 0


def test_every_reason_says_a_sentence() -> None:
    texts = [reason.value for reason in Reason]
    assert all(len(text.split()) >= 4 for text in texts)
    assert len(set(texts)) == len(texts)


def test_a_clock_that_is_set_back_holds_the_hand() -> None:
    target = TargetFilter(TargetSettings())
    trust = SafetySupervisor(SafetySettings(), target)
    for index in range(40):
        time_s = 100.0 + index / 30
        trust.advance(time_s)
        trust.see(None, FakeEstimate(time_s, Pose.identity(), confidence=1.0))
    trust.advance(101.4)
    assert not trust.holding()
    trust.advance(5.0)
    assert trust.holding()

"""Laws of what is believed of a target that was not seen for a while, and of what is told of it."""

from collections.abc import Callable

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import (
    WORLD_FROM_OBJECT,
    Loop,
    Seen,
    goal_at,
    position_errors,
    still,
    to_and_fro,
)
from tiers import tiered

from servoid._native import change_between, shifted_and_turned
from servoid.pose import Pose
from servoid.servo import Reason
from servoid.servo.belief.target import TargetFilter
from servoid.servo.keeping.safety import ORDINARY
from servoid.servo.settings import SafetySettings, TargetSettings
from servoid.source.source import Instant

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

FIRST_S = 3.0
ASIDE = np.array([0.0, 0.25, 0.1, 0.0, 0.0, 0.0])
NOISE = np.diag(np.square(np.repeat([0.0005, 0.01], 3)))


def found_again(
    seen: Pose, confidence: float, unobservable: np.ndarray | None = None, first: int = 0
) -> Pose:
    """Return what is believed after a gap of a second and the estimates for which a hold waits.

    The first ones are doubted, whatever the others are.
    """
    target = TargetFilter(TargetSettings())
    for index in range(90):
        target.update(FakeEstimate(index / 30, WORLD_FROM_OBJECT, "tracking", 1.0))
    target.forget()
    for index in range(120, 120 + SafetySettings().resume_after):
        share = 0.1 if index < 120 + first else confidence
        estimate = FakeEstimate(index / 30, seen, "tracking", share, covariance=NOISE)
        if unobservable is not None:
            estimate.unobservable = unobservable
        target.update(estimate)
    assert target.time_s is not None
    return target.predict(target.time_s).world_from_object


def turned(*turn: float) -> Pose:
    return shifted_and_turned(WORLD_FROM_OBJECT, np.array([0.0, 0.0, 0.0, *turn]))


def turn_between(one: Pose, other: Pose) -> float:
    return float(np.degrees(np.linalg.norm(change_between(one, other)[3:])))


@pytest.mark.parametrize("confidence", tiered([0.1, 0.3, 0.6]))
def test_a_turn_that_is_doubted_after_a_gap_is_rather_what_it_was(confidence: float) -> None:
    wrong = turned(0.1, -0.08, 0.05)
    assert turn_between(WORLD_FROM_OBJECT, wrong) > 7.0
    believed = turn_between(WORLD_FROM_OBJECT, found_again(wrong, confidence))
    assert believed < 0.25 * turn_between(WORLD_FROM_OBJECT, wrong)


@pytest.mark.parametrize("confidence", [0.98, 1.0])
@pytest.mark.parametrize("turn", tiered([0.58, 0.1, 2.5]))
def test_a_turn_that_is_told_well_after_a_gap_is_believed(turn: float, confidence: float) -> None:
    there = turned(turn, 0.0, 0.0)
    assert turn_between(there, found_again(there, confidence)) < 0.02 * np.degrees(turn) + 0.1


@pytest.mark.parametrize("first", [1, 5])
def test_a_turn_that_is_doubted_only_at_first_is_believed_as_soon(first: int) -> None:
    there = turned(0.3, 0.4, 0.0)
    assert turn_between(there, found_again(there, 0.98, first=first)) < 1.0


@pytest.mark.parametrize("confidence", [0.2, 1.0])
def test_a_place_that_is_told_after_a_gap_is_believed(confidence: float) -> None:
    there = WORLD_FROM_OBJECT @ Pose.from_parts([0.15, 0.05, -0.1], [1.0, 0.0, 0.0, 0.0])
    off = change_between(there, found_again(there, confidence))[:3]
    assert np.linalg.norm(off) < 1e-3


def test_turns_that_are_all_open_are_after_a_gap_what_they_were() -> None:
    axes = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
    believed = found_again(turned(0.5, 0.2, -0.4), 1.0, axes)
    assert turn_between(WORLD_FROM_OBJECT, believed) < 1e-3


def test_a_hand_on_its_way_to_its_goal_says_so_until_it_is_there() -> None:
    offset = np.array([0.15, -0.1, 0.1, 0.0, 0.0, 0.0])
    ticks = [tick for tick in Loop(still(goal_at(offset))).run(5.0) if not tick.command.holding]
    errors, reported = (
        position_errors(ticks),
        [Reason.AWAY in one.command.limiting for one in ticks],
    )
    away = SafetySettings().away
    assert errors[0] > 0.2 and errors[-1] < 1e-3
    np.testing.assert_array_equal(reported, errors > away)


def lost(instant: Instant, estimate: FakeEstimate) -> Seen:
    estimate.status = "lost"
    return instant, estimate


Fault = Callable[[Instant, FakeEstimate], Seen]


def between(fault: Fault, first_s: float, last_s: float) -> Fault:
    def spoiled(instant: Instant, estimate: FakeEstimate) -> Seen:
        it_is = first_s <= instant.time_s < last_s
        return fault(instant, estimate) if it_is else (instant, estimate)

    return spoiled


def test_a_target_that_is_not_seen_is_told_before_it_holds_the_hand() -> None:
    late_s = 0.1  # until its images have come
    ticks = Loop(to_and_fro(10), spoil=between(lost, FIRST_S, FIRST_S + 0.1)).run(5.0)
    reported = [tick.time_s for tick in ticks if Reason.UNSEEN in tick.command.limiting]
    assert FIRST_S < reported[0] < FIRST_S + late_s
    assert FIRST_S + 0.1 < reported[-1] < FIRST_S + 0.1 + late_s
    assert not any(tick.command.holding for tick in ticks if tick.time_s > FIRST_S - 1.0)


@pytest.mark.parametrize("hidden_s", [0.0, 1.0])
def test_the_hand_is_never_far_off_a_target_that_leapt_without_a_word(hidden_s: float) -> None:
    swings = to_and_fro(10)

    def path(time_s: float) -> Pose:
        leap = ASIDE if time_s >= FIRST_S else np.zeros(6)
        return shifted_and_turned(swings(time_s), leap)

    ticks = Loop(path, spoil=between(lost, FIRST_S, FIRST_S + hidden_s)).run(8.0)
    late = [tick for tick in ticks if tick.time_s > FIRST_S + 0.1]
    commands = [tick.command for tick in late]
    reported = np.array([bool(one.holding or one.limiting - ORDINARY) for one in commands])
    off = position_errors(late)
    assert off.max() > 0.2 and off[-1] < 0.01
    assert not (~reported & (off > 0.03)).any()


def test_a_leap_that_one_estimate_told_before_a_gap_is_believed_right_after_it() -> None:
    leap = np.array([0.1, 0.1, 0.05, 0.4, 0.3, 0.0])

    def path(time_s: float) -> Pose:
        leaps = time_s >= FIRST_S - 1e-6
        return shifted_and_turned(WORLD_FROM_OBJECT, leap) if leaps else WORLD_FROM_OBJECT

    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        estimate.confidence, estimate.covariance = 0.98, NOISE
        return between(lost, FIRST_S + 0.02, FIRST_S + 0.6)(instant, estimate)

    ticks = Loop(path, spoil=spoil).run(FIRST_S + 1.5)
    late = [tick for tick in ticks if tick.time_s > FIRST_S + 0.7]
    moving = [tick for tick in late if not tick.command.holding]
    assert moving[0].time_s < FIRST_S + 1.2
    believed = moving[0].command.world_from_object
    assert believed is not None
    assert turn_between(path(FIRST_S), believed) < 2.0

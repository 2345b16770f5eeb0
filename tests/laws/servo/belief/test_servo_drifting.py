"""Laws of turns that are seen and not believed: when they hold the hand."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import (
    WORLD_FROM_OBJECT,
    Loop,
    Path,
    Seen,
    Tick,
    broken_limits,
    position_errors,
    still,
    to_and_fro,
)
from tiers import tiered

from servoid._native import change_between, shifted_and_turned
from servoid.pose import Pose
from servoid.servo import Reason
from servoid.servo.belief.watchdog import Drifting
from servoid.servo.settings import SafetySettings
from servoid.source.source import Instant

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

RATE_HZ = 30.0
LEVER = 0.55  # m, from the object to the hand
Turn = Callable[[float], float]


@dataclass
class Doubted(FakeEstimate):
    """An estimate whose place is confirmed, and whose turn is not."""

    @property
    def located(self) -> bool:
        return True


def turned(turn: float) -> np.ndarray:
    return np.array([0.0, 0.0, 0.0, 0.0, 0.0, turn])


def rocking(degrees: float, period_s: float, until_s: float = np.inf) -> Turn:
    """Turn to and fro from 2 s on; it ends where it began."""

    def turn(time_s: float) -> float:
        since = min(max(time_s - 2.0, 0.0), until_s - 2.0)
        return float(np.radians(degrees) * np.sin(2.0 * np.pi * since / period_s))

    return turn


def followed(
    true: Turn,
    seen: Turn,
    seconds: float,
    confidence: float = 0.3,
    path: Path | None = None,
    hidden: tuple[float, float] = (0.0, 0.0),
    sure: tuple[float, float] = (0.0, np.inf),
) -> tuple[Loop, list[Tick]]:
    """Follow an object that truly turns, and is seen to turn, about the upright.

    It is hidden between two times, and its turn is told well until one time and from another on.
    """
    places = path or still(WORLD_FROM_OBJECT)

    def spoiled(instant: Instant, estimate: FakeEstimate) -> Seen:
        if hidden[0] <= instant.time_s < hidden[1]:
            return None, None
        pose = shifted_and_turned(places(estimate.time_s), turned(seen(estimate.time_s)))
        doubted = confidence < 0.8 and sure[0] <= instant.time_s < sure[1]
        spread = np.diag([1e-7] * 3 + [3e-3] * 3) if doubted else 1e-8 * np.eye(6)
        status, share = ("searching", confidence) if doubted else ("tracking", 1.0)
        return instant, Doubted(
            estimate.time_s, pose, status=status, confidence=share, covariance=spread
        )

    def truth(time_s: float) -> Pose:
        return shifted_and_turned(places(time_s), turned(true(time_s)))

    loop = Loop(truth, spoil=spoiled)
    return loop, loop.run(seconds)


def adrift(ticks: list[Tick]) -> np.ndarray:
    return np.array([Reason.ADRIFT in tick.command.holding for tick in ticks])


def test_turns_that_come_and_go_and_are_doubted_hold_the_hand_and_are_told() -> None:
    rock = rocking(25.0, 6.0)
    loop, ticks = followed(rock, rock, 8.0)
    held, times = adrift(ticks), np.array([tick.time_s for tick in ticks])
    assert not held[times < 2.0].any()
    first = times[held][0]
    assert first < 4.0 and held[times > first].mean() > 0.9
    assert broken_limits(loop) == []
    # The eyes stay on it.
    assert max(tick.fixation for tick in ticks if tick.time_s > 1.0) < np.radians(1.0)
    still = [tick for tick in ticks if tick.time_s > first + 0.5]
    assert all(np.abs(tick.command.velocities[:7]).max() < 1e-6 for tick in still)


def test_a_turn_that_is_always_wrong_alike_holds_nothing() -> None:
    _, ticks = followed(
        lambda _: 0.0, lambda time_s: float(np.radians(5.0 * (time_s > 0.3))), 6.0,
        path=to_and_fro(6.0),
    )  # fmt: skip
    assert not adrift([tick for tick in ticks if tick.time_s > 3.0]).any()


def test_a_turn_that_is_told_well_is_followed_and_holds_nothing() -> None:
    rock = rocking(25.0, 6.0)
    _, ticks = followed(rock, rock, 8.0, confidence=1.0)
    assert not adrift(ticks).any()
    assert np.linalg.norm(ticks[-1].error[:3]) < 0.02


def test_a_hand_that_was_held_moves_on_when_turns_have_calmed_down() -> None:
    rock = rocking(30.0, 4.0, until_s=6.0)
    _, ticks = followed(rock, rock, 13.0)
    held, times = adrift(ticks), np.array([tick.time_s for tick in ticks])
    last = times[held][-1]
    settings = SafetySettings()
    assert held.any() and 6.0 + settings.calm_s - 0.5 < last < 12.0
    assert not ticks[-1].command.holding


@pytest.mark.parametrize("degrees", [8.0, 12.0])
def test_a_hand_that_was_held_stays_so_while_the_object_stays_turned(degrees: float) -> None:
    def turn(time_s: float) -> float:
        return float(np.radians(degrees)) * min(max(time_s - 2.0, 0.0), 1.0)

    _, ticks = followed(turn, turn, 14.0, sure=(1.5, np.inf))
    held = np.array([bool(tick.command.holding) for tick in ticks if tick.time_s > 4.0])
    assert held.all()


@pytest.mark.parametrize("rate_deg", tiered([1.5, 4.0]))
def test_a_doubted_turn_leads_a_hand_only_so_far(rate_deg: float) -> None:
    def turn(time_s: float) -> float:
        return float(np.radians(rate_deg)) * max(time_s - 2.0, 0.0)

    _, ticks = followed(turn, turn, 14.0, sure=(1.5, np.inf))
    off = position_errors(ticks)
    held = np.array([bool(tick.command.holding) for tick in ticks])
    believed = [tick.command.world_from_object for tick in ticks]
    assert off.max() > 0.04 and held[-1]
    moving = [pose for pose, holds in zip(believed, held, strict=True) if pose and not holds]
    led = [LEVER * np.linalg.norm(change_between(WORLD_FROM_OBJECT, one)[3:]) for one in moving]
    assert max(led) < SafetySettings().adrift + 0.002


def test_a_hand_that_a_doubted_turn_led_too_far_moves_on_once_it_is_told_well() -> None:
    def turn(time_s: float) -> float:
        return float(np.radians(12.0)) * min(max(time_s - 2.0, 0.0) / 4.0, 1.0)

    _, ticks = followed(turn, turn, 13.0, sure=(1.5, 8.0))
    held = np.array([bool(tick.command.holding) for tick in ticks])
    times = np.array([tick.time_s for tick in ticks])
    assert held[(times > 6.0) & (times < 8.0)].all()
    assert not held[times > 12.0].any()
    assert position_errors(ticks)[-1] < 0.005


@pytest.mark.parametrize("degrees", tiered([33.0, 20.0, -90.0]))
def test_what_turned_unseen_and_is_doubted_holds_the_hand_for_good(degrees: float) -> None:
    def turn(time_s: float) -> float:
        return float(np.radians(degrees)) * (time_s > 2.5)

    _, ticks = followed(turn, turn, 7.0, hidden=(2.0, 3.0), sure=(1.5, np.inf))
    held = [bool(tick.command.holding) for tick in ticks if tick.time_s > 2.5]
    assert all(held)
    assert adrift([tick for tick in ticks if tick.time_s > 4.0]).all()


def test_what_was_hidden_and_did_not_turn_is_followed_as_well_as_before() -> None:
    _, ticks = followed(
        lambda _: 0.0,
        lambda time_s: float(np.radians(5.0 * (time_s > 1.5))),
        7.0,
        path=to_and_fro(6.0),
        hidden=(2.0, 3.0),
        sure=(1.5, np.inf),
    )
    late = [tick for tick in ticks if tick.time_s > 5.0]
    assert not any(tick.command.holding for tick in late)
    assert position_errors(late).max() < 0.012


def seen_by(watch: Drifting, turn: Turn, seconds: float, spread: float = 0.0) -> list[float]:
    """Return when a watch held, as it saw turns off what is believed."""
    times = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    held = []
    for time_s in times:
        watch.see(time_s, turned(turn(time_s))[3:], spread)
        if watch.holds:
            held.append(float(time_s))
    return held


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_what_lasts_holds_from_five_times_what_comes_and_goes(share: float) -> None:
    limit = SafetySettings().adrift / LEVER
    watch = Drifting(SafetySettings())
    watch.reach(LEVER)
    assert bool(seen_by(watch, lambda _: 5.0 * share * limit, 20.0)) == (share > 1.0)


def test_noise_from_image_to_image_holds_nothing() -> None:
    random = np.random.default_rng(5)
    watch = Drifting(SafetySettings())
    watch.reach(LEVER)
    assert seen_by(watch, lambda _: float(np.radians(4.0) * random.normal()), 30.0) == []


def test_where_there_is_no_goal_turns_hold_nothing() -> None:
    watch = Drifting(SafetySettings())
    assert seen_by(watch, rocking(40.0, 3.0), 10.0) == []


def test_what_the_tracker_says_that_its_turns_may_be_off_does_not_count_as_new() -> None:
    rock = rocking(6.0, 6.0)
    watches = [Drifting(SafetySettings()) for _ in range(2)]
    for watch in watches:
        watch.reach(LEVER)
    assert seen_by(watches[0], rock, 10.0, spread=np.radians(2.0))
    assert seen_by(watches[1], rock, 10.0, spread=np.radians(15.0)) == []

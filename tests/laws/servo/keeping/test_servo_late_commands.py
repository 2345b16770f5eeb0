"""Laws of commands that come less often than the arm's period: nothing swings, and it is said."""

from collections.abc import Callable

import numpy as np
import pytest
from servo_loop import Loop, Tick, goal_at, still

from servoid.pose import Floats
from servoid.servo import Reason, ServoSettings
from servoid.servo.settings import SafetySettings

ASIDE = np.array([0.1, -0.05, 0.1, 0.0, 0.0, 0.0])
FAR_ASIDE = np.array([0.25, -0.2, 0.0, 0.0, 0.3, 0.0])
AT_REST = 0.05  # rad/s


def drawn(most: int) -> Callable[[], int]:
    """Return how many periods each command lasts, drawn anew each time, from 1 to `most`."""
    random = np.random.default_rng(0)
    return lambda: int(random.integers(1, most + 1))


def reasons(ticks: list[Tick]) -> set[Reason]:
    return {reason for tick in ticks for reason in tick.command.limiting}


LATE = pytest.mark.parametrize("periods", [lambda: 2, drawn(2), drawn(3)], ids=["2", "1-2", "1-3"])


@LATE
@pytest.mark.parametrize("offset", [ASIDE, FAR_ASIDE], ids=["aside", "far aside"])
def test_cameras_come_to_rest_on_an_object_at_rest_though_commands_are_late(
    offset: Floats, periods: Callable[[], int]
) -> None:
    loop = Loop(still(goal_at(offset)), periods=periods)
    loop.run(8.0)
    last = loop.run(2.0)
    assert max(float(np.abs(tick.state.velocities).max()) for tick in last) < AT_REST
    assert max(tick.fixation for tick in last) < np.radians(0.5)


@LATE
def test_commands_that_are_late_are_told_of(periods: Callable[[], int]) -> None:
    loop = Loop(still(goal_at(ASIDE)), periods=periods)
    loop.run(1.0)
    assert all(Reason.LATE in tick.command.limiting for tick in loop.run(1.0))


def test_commands_that_are_in_time_or_skip_a_period_now_and_then_are_not_late() -> None:
    random = np.random.default_rng(1)
    for periods in (lambda: 1, lambda: 2 if random.random() < 0.05 else 1):
        assert Reason.LATE not in reasons(Loop(still(goal_at(ASIDE)), periods=periods).run(3.0))


def test_one_long_gap_is_not_told_as_commands_that_are_late() -> None:
    loop = Loop(still(goal_at(ASIDE)))
    loop.run(1.0)
    for _ in range(50):
        loop.arm.command(np.zeros(len(loop.arm.joints.names)))
    assert Reason.LATE not in reasons(loop.run(1.0))


def test_commands_are_no_longer_late_soon_after_they_come_in_time_again() -> None:
    loop = Loop(still(goal_at(ASIDE)), periods=lambda: 2)
    loop.run(2.0)
    loop.periods = lambda: 1
    loop.run(0.5)
    assert Reason.LATE not in reasons(loop.run(1.0))


def searching() -> Callable[[], int]:
    """Return how long commands last where the tracker takes 12 periods for every tenth."""
    count = iter(range(10_000))
    return lambda: 12 if next(count) % 10 == 9 else 1


PACES = {str(each): lambda each=each: each for each in (1, 2, 3, 4, 5, 8, 25)}
PACED = pytest.mark.parametrize("pace", [*PACES, "1-3", "searching"])


def paced(pace: str) -> Callable[[], int]:
    return searching() if pace == "searching" else drawn(3) if pace == "1-3" else PACES[pace]


@PACED
def test_no_wall_is_passed_however_late_commands_come(pace: str) -> None:
    start = Loop(still(goal_at(ASIDE)))
    y = start.arm.world_from_hand(start.arm.state().positions).translation[1]
    room = SafetySettings(workspace_lower=(-5.0, y - 0.05, -5.0), workspace_upper=(5.0, 5.0, 5.0))
    beyond = np.array([0.0, -0.3, 0.0, 0.0, 0.0, 0.0])
    loop = Loop(still(goal_at(beyond)), ServoSettings(safety=room), periods=paced(pace))
    most = 0.0
    for tick in loop.run(6.0):
        hand = loop.arm.world_from_hand(tick.state.positions).translation
        most = max(most, y - 0.05 - hand[1])
    # One stop of the program is no pace: until there is another, the joints move on as they did.
    assert most < (0.02 if pace == "searching" else 1e-3)


@pytest.mark.parametrize("pace", ["5", "8", "25", "searching"])
def test_a_hand_whose_commands_come_too_rarely_to_brake_it_is_held(pace: str) -> None:
    loop = Loop(still(goal_at(FAR_ASIDE)), periods=paced(pace))
    loop.run(1.0)
    last = loop.run(1.0)
    if pace == "searching":
        assert all(Reason.LATE in tick.command.limiting for tick in last)
        return
    assert all(Reason.LATE in tick.command.holding for tick in last)
    hand = slice(0, loop.arm.joints.hand_count)
    assert not any(tick.command.velocities[hand].any() for tick in last)

"""Laws of commands that come less often than the arm's period: nothing swings, and it is said."""

from collections.abc import Callable

import numpy as np
import pytest
from servo_loop import Loop, Tick, goal_at, still

from servoid.pose import Floats
from servoid.servo import Reason

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

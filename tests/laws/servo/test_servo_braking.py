"""An arm is brought to rest however a block ends, whatever is raised meanwhile."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from servo_loop import Loop, to_and_fro

from servoid.errors import ServoError
from servoid.servo import Command, brought_to_rest

SENT = 2  # braking commands, after which something fails


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_an_arm_is_brought_to_rest_within_its_limits_however_a_block_ends(
    error: type[BaseException],
) -> None:
    loop = Loop(to_and_fro(4.0))
    commanded: list[np.ndarray] = []
    with (
        pytest.raises(error),
        brought_to_rest(loop.arm, loop.controller, lambda one: commanded.append(one.velocities)),
    ):
        last = loop.run(2.0)[-1].command.velocities
        raise error
    speeds = np.array([last, *commanded])
    steps = np.abs(np.diff(speeds, axis=0)) / loop.arm.period_s
    assert np.abs(last).max() > 0.02
    assert np.all(steps <= loop.arm.joints.acceleration * (1.0 + 1e-9))
    assert not commanded[-1].any()
    for _ in range(50):
        loop.arm.command(commanded[-1])
    assert np.abs(loop.arm.state().velocities).max() < 1e-4


def test_an_arm_is_brought_to_rest_though_who_watches_it_fails() -> None:
    loop = Loop(to_and_fro(4.0))

    def fail(_: Command) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError), brought_to_rest(loop.arm, loop.controller, fail):
        last = loop.run(2.0)[-1].command.velocities
    assert np.abs(last).max() > 0.02
    assert not loop.controller.rest(loop.arm.state()).velocities.any()


def failing(call: Callable[..., Any], error: BaseException, since: int, until: float) -> Any:
    """Return a method that raises in some of its calls, which are counted from 0."""
    calls = iter(range(10_000))

    def fails(*given: Any) -> Any:
        if since <= next(calls) < until:
            raise error
        return call(*given)

    return fails


# Each is called once a period, the Jacobian twice.
@pytest.mark.parametrize(
    ("method", "error", "since", "until"),
    [
        ("command", KeyboardInterrupt(), SENT, SENT + 1),
        ("command", OSError("the bus had a hiccup"), SENT, SENT + 2),
        ("state", KeyboardInterrupt(), SENT, SENT + 1),
        ("state", TimeoutError("no joint state came"), SENT, SENT + 1),
        ("state", TimeoutError("no joint state came"), 0, np.inf),
        ("jacobian", ValueError("a robot's model"), 0, np.inf),
        ("world_from_hand", ValueError("a robot's model"), SENT, np.inf),
    ],
)
def test_an_arm_is_brought_to_rest_though_itself_or_an_interrupt_fails_meanwhile(
    method: str,
    error: BaseException,
    since: int,
    until: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = Loop(to_and_fro(4.0))
    speeds: list[np.ndarray] = []
    send = loop.arm.command

    def noted(velocities: np.ndarray) -> None:
        speeds.append(velocities)
        send(velocities)

    with (
        pytest.raises(ZeroDivisionError),
        brought_to_rest(loop.arm, loop.controller),
    ):
        speeds.append(loop.run(2.0)[-1].command.velocities)
        monkeypatch.setattr(loop.arm, "command", noted)
        call = getattr(loop.arm, method)
        monkeypatch.setattr(loop.arm, method, failing(call, error, since, until))
        raise ZeroDivisionError
    assert np.abs(speeds[0]).max() > 0.02
    assert len(speeds) > SENT + 1 and not speeds[-1].any()
    # A command that was lost makes the next step of the speeds larger by one.
    lost = 1 + until - since if method == "command" else 1
    steps = np.abs(np.diff(np.array(speeds), axis=0)) / loop.arm.period_s
    assert np.all(steps <= lost * loop.arm.joints.acceleration * (1.0 + 1e-9))


def test_what_is_raised_while_an_arm_is_brought_to_rest_is_raised_once_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = Loop(to_and_fro(4.0))
    with pytest.raises(KeyboardInterrupt), brought_to_rest(loop.arm, loop.controller):
        loop.run(2.0)
        sent = failing(loop.arm.command, KeyboardInterrupt(), SENT, SENT + 1)
        monkeypatch.setattr(loop.arm, "command", sent)
    assert not loop.controller.rest(loop.arm.state()).velocities.any()


def test_an_arm_that_takes_no_command_any_more_may_still_move(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = Loop(to_and_fro(4.0))
    with (
        pytest.raises(ServoError, match=r"commands in a row failed; it may still move .* stop it"),
        brought_to_rest(loop.arm, loop.controller),
    ):
        loop.run(2.0)
        dead = failing(loop.arm.command, OSError("the bus is dead"), 0, np.inf)
        monkeypatch.setattr(loop.arm, "command", dead)
        raise KeyboardInterrupt

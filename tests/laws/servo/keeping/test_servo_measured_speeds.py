"""Laws of measured joint speeds that are wrong: no command exceeds the limits of the joints."""

from dataclasses import replace

import numpy as np
import pytest
from servo_loop import GOAL_FROM_OBJECT, Loop, goal_at, still

from servoid.servo import Command, JointState, Reason

OFFSET = np.array([0.06, 0.17, 0.08, 0.0, 0.35, 0.0])
FAST = pytest.mark.parametrize("share", [-50.0, -1.5, 1.2, 1.9, 10.0, 1e6])


def reading(loop: Loop, share: float) -> JointState:
    """Return the arm's state, with speeds off by a share of their limits."""
    state = loop.arm.state()
    return replace(state, velocities=state.velocities + share * loop.arm.joints.speed)


def answers(loop: Loop, share: float) -> list[Command]:
    """Return the commands that follow a state with wrong speeds."""
    first = loop.controller.command(reading(loop, share), GOAL_FROM_OBJECT)
    loop.arm.command(first.velocities)
    return [first, *(tick.command for tick in loop.run(0.5))]


def exceeding(loop: Loop, commands: list[Command]) -> float:
    """Return the greatest share of a joint's speed limit in commands."""
    return max(float((np.abs(one.velocities) / loop.arm.joints.speed).max()) for one in commands)


@FAST
def test_no_command_exceeds_the_joints_speeds_whatever_the_first_state_says(share: float) -> None:
    loop = Loop(still(goal_at(OFFSET)))
    assert exceeding(loop, answers(loop, share)) <= 1.0


@FAST
def test_no_command_exceeds_the_joints_speeds_after_missed_periods(share: float) -> None:
    loop = Loop(still(goal_at(OFFSET)))
    loop.run(1.0)
    for _ in range(10):
        loop.arm.command(np.zeros(len(loop.arm.joints.names)))
    assert exceeding(loop, answers(loop, share)) <= 1.0


def test_a_joint_that_seems_to_move_at_ten_times_its_limit_holds_the_hand() -> None:
    loop = Loop(still(goal_at(OFFSET)))
    loop.run(1.0)
    holding = [
        loop.controller.command(reading(loop, share), GOAL_FROM_OBJECT).holding
        for share in (0.5, 10.0)
    ]
    assert holding == [frozenset(), {Reason.BAD_STATE}]


@pytest.mark.parametrize("speed", [-0.5, 0.3, 0.5, 0.9])
@pytest.mark.parametrize("count", [1, 5])
def test_a_wrong_speed_at_the_start_does_not_move_an_arm_at_rest(speed: float, count: int) -> None:
    loop = Loop(still(goal_at(OFFSET)))
    for _ in range(count):
        state = loop.arm.state()
        wrong = replace(state, velocities=state.velocities + speed)
        command = loop.controller.command(wrong, GOAL_FROM_OBJECT)
        assert not command.velocities.any()
        assert command.holding == {Reason.BAD_STATE}
        loop.arm.command(command.velocities)
    ticks = loop.run(4.0)
    assert Reason.BAD_STATE not in ticks[0].command.holding
    assert not ticks[-1].command.holding


def test_a_wrong_speed_after_missed_periods_does_not_move_an_arm_at_rest() -> None:
    loop = Loop(still(goal_at(OFFSET)))
    loop.run(1.0)
    for _ in range(60):
        loop.arm.command(np.zeros(len(loop.arm.joints.names)))
    state = loop.arm.state()
    wrong = replace(state, velocities=state.velocities + 0.5)
    assert not loop.controller.command(wrong, GOAL_FROM_OBJECT).velocities.any()


def test_an_arm_that_ran_on_while_commands_were_missed_continues_at_its_speed() -> None:
    loop = Loop(still(goal_at(OFFSET)))
    before = loop.run(1.0)[-1].command
    assert np.abs(before.velocities).max() > 0.1
    for _ in range(5):
        loop.arm.command(before.velocities)
    after = loop.controller.command(loop.arm.state(), GOAL_FROM_OBJECT)
    assert Reason.BAD_STATE not in after.holding
    assert np.abs(after.velocities - before.velocities).max() < 0.2  # the joints lag

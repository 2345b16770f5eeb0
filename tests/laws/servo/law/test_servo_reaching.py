"""Laws of what a hand is told that cannot come to its goal."""

import numpy as np
import pytest
from servo_loop import (
    GOAL_FROM_OBJECT,
    WORLD_FROM_OBJECT,
    Loop,
    Tick,
    goal_at,
    still,
    to_and_fro,
)
from tiers import tiered

from servoid._native import shifted_and_turned
from servoid.pose import Pose
from servoid.servo import (
    ORDINARY,
    JointLaw,
    Reason,
    ServoLog,
    ServoRow,
    ServoSettings,
    limited_s,
    main_limit,
)
from servoid.servo import Tick as ControlTick
from servoid.servo.law.reach import reached
from servoid.servo.settings import JointSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

LAWS = pytest.mark.parametrize("law", list(JointLaw), ids=lambda law: law.value)
STUCK = {Reason.UNREACHABLE, Reason.SINGULAR, Reason.JOINT_LIMIT}
REPORTED_S = 0.3


def by(law: JointLaw) -> ServoSettings:
    return ServoSettings(joints=JointSettings(law=law))


def can_be_reached(loop: Loop, world_from_object: Pose) -> bool:
    goal = world_from_object @ GOAL_FROM_OBJECT.inverse()
    return reached(loop.arm, goal, loop.arm.state().positions) is not None


def off(tick: Tick) -> float:
    """Return how far from its goal the hand believes to be, in metres."""
    assert tick.command.hand_from_goal is not None
    return float(np.linalg.norm(tick.command.hand_from_goal.translation))


@LAWS
def test_an_object_out_of_reach_is_told_and_told_no_more_when_it_is_back(law: JointLaw) -> None:
    away = np.array([-0.35, 0.25, 0.1, 0.0, 0.3, 0.5])  # turned by 34 degrees
    beyond = shifted_and_turned(WORLD_FROM_OBJECT, away)
    loop = Loop(lambda time_s: beyond if 1.5 < time_s < 4.5 else WORLD_FROM_OBJECT, by(law))
    assert can_be_reached(loop, WORLD_FROM_OBJECT) and not can_be_reached(loop, beyond)
    before, beyond_reach, after = loop.run(1.5), loop.run(3.0), loop.run(3.0)
    assert not [tick for tick in before if tick.command.limiting & STUCK]
    asked_s = next(
        tick.time_s
        for tick in beyond_reach
        if not tick.command.holding
        and np.linalg.norm(tick.command.hand_from_goal.translation) > 0.1
    )
    reported = [tick.time_s for tick in beyond_reach if Reason.UNREACHABLE in tick.command.limiting]
    assert reported[0] <= asked_s + REPORTED_S
    assert len(reported) == sum(tick.time_s >= reported[0] for tick in beyond_reach)
    if law is JointLaw.PAPER:
        # The pseudo-inverse knows no stops: what it did in the singular pose may end at one of
        # them, or fold the arm otherwise, by chance, and it does not find back. It must say so.
        home = np.linalg.norm(after[-1].error[:3]) < 5e-3
        assert home or {Reason.JOINT_LIMIT, Reason.AWAY} & after[-1].command.limiting
        return
    last = max(tick.time_s for tick in after if tick.command.limiting & STUCK)
    back_s = next(tick.time_s for tick in after if tick.command.holding)
    assert last <= back_s + 1.5
    assert np.linalg.norm(after[-1].error[:3]) < 5e-3


@LAWS
def test_an_arm_that_is_stretched_towards_its_goal_says_so(law: JointLaw) -> None:
    ahead = np.array([-1.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    loop = Loop(still(goal_at(ahead)), by(law))
    loop.run(4)
    arm, state = loop.arm, loop.arm.state()
    # The paper's pseudo-inverse is not damped, and trembles about where it would be singular.
    assert np.linalg.svd(arm.jacobian(state.positions))[1][-1] < 0.1
    for tick in loop.run(0.5):
        assert tick.command.limiting >= {Reason.UNREACHABLE, Reason.SINGULAR}


def test_a_joint_at_its_stop_is_told() -> None:
    positions = SerialArm(read_arm()).state().positions
    positions[6] += np.radians(160)
    turned = SerialArm(read_arm(), positions=positions.tolist())
    goal = turned.world_from_hand(positions) @ Pose.exp([0, 0, 0, 0, 0, 0.3])
    loop = Loop(still(goal @ GOAL_FROM_OBJECT), positions=positions)
    ticks = loop.run(3)
    assert turned.joints.upper[6] - ticks[-1].state.positions[6] < 0.05
    assert Reason.JOINT_LIMIT in ticks[-1].command.limiting


@LAWS
@pytest.mark.parametrize("seed", tiered(range(3)))
def test_goals_that_are_reached_raise_no_false_alarm(law: JointLaw, seed: int) -> None:
    random = np.random.default_rng(seed)
    loop = Loop(to_and_fro(10), by(law), noise=(0.0005, 0.005), seed=seed)
    loop.run(4)
    for _ in range(2):
        offset = random.uniform(-1, 1, 6) * np.repeat([0.1, 0.3], 3)
        loop.path = still(goal_at(offset))
        loop.run(2.5)
    assert not [tick.time_s for tick in loop.ticks if tick.command.limiting & STUCK]


def test_a_log_says_for_how_long_bounds_kept_the_hand_from_its_goal() -> None:
    loop = Loop(still(goal_at(np.array([-1.0, 0.0, 0.3, 0.0, 0.0, 0.0]))))
    log = ServoLog.of(loop.arm)
    for tick in loop.run(2.0):
        control = ControlTick(tick.state, None, None, tick.command, 0.0, 0.0)
        log.add(ServoRow(control, Pose.identity(), None, None, None))
    found = limited_s(log)
    reported = [row.tick.command.limiting for row in log.rows]
    assert Reason.UNREACHABLE in found and not found.keys() & ORDINARY
    assert any(reasons & ORDINARY for reasons in reported)
    for reason, seconds in found.items():
        count = sum(reason in reasons for reasons in reported)
        assert seconds == pytest.approx(count * loop.arm.period_s)
    # Other bounds act longer on a hand that hastens to a goal which it cannot reach.
    assert main_limit(log) == (Reason.UNREACHABLE, found[Reason.UNREACHABLE])
    assert main_limit(ServoLog.of(loop.arm)) is None

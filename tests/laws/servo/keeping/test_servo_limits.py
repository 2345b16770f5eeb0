"""Laws of the limits of the hand and of the joints, whatever goals, jumps and holds come."""

from dataclasses import replace

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import (
    GOAL_FROM_OBJECT,
    PERIOD_S,
    Loop,
    Seen,
    broken_limits,
    goal_at,
    hand_shares_of,
    position_errors,
    to_and_fro,
)
from tiers import tiered

from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import Controller, JointLaw, Joints, ServoSettings
from servoid.servo.settings import JointSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source.source import Instant

LAWS = pytest.mark.parametrize("law", list(JointLaw), ids=lambda law: law.value)


def jumping(seed: int, law: JointLaw) -> Loop:
    """Drive an arm by goals and objects that jump, and by a tracker that loses the object."""
    random = np.random.default_rng(seed)
    sizes = np.repeat([0.25, 0.8], 3)
    places = [goal_at(random.uniform(-1, 1, 6) * sizes) for _ in range(3)]
    goals = [Pose.exp(random.uniform(-1, 1, 6) * 0.5 * sizes) for _ in range(4)]
    teleports = sorted(random.uniform(0.5, 6.0, 2).tolist())
    lost_s = float(random.uniform(0.5, 5.0))

    def path(time_s: float) -> Pose:
        return places[int(np.searchsorted(teleports, time_s))]

    def goal(time_s: float) -> Pose:
        return GOAL_FROM_OBJECT @ goals[int(time_s / 1.7) % 4]

    def spoil(instant: Instant, estimate: FakeEstimate) -> Seen:
        return instant, None if lost_s < estimate.time_s < lost_s + 0.6 else estimate

    chosen = ServoSettings(joints=JointSettings(law=law))
    return Loop(path, chosen, goal=goal, spoil=spoil, seed=seed)


def shares_of(loop: Loop) -> dict[str, float]:
    commanded = np.array([tick.command.twist for tick in loop.ticks])
    went = np.array([tick.hand_twist for tick in loop.ticks])
    return hand_shares_of(commanded, went, loop.arm.period_s)


def assert_kept(loop: Loop) -> None:
    shares = shares_of(loop)
    assert max(shares["told speed"], shares["told acceleration"]) <= 1.0, shares
    # Joints that lag behind commands mean them, so that what they do is nearly as bounded.
    assert max(shares["went speed"], shares["went acceleration"]) <= 1.02, shares
    assert broken_limits(loop) == []


@LAWS
@pytest.mark.parametrize("seed", [1, 2])
def test_the_hand_keeps_its_limits_through_jumps_and_holds(law: JointLaw, seed: int) -> None:
    loop = jumping(seed, law)
    loop.run(5)
    assert_kept(loop)


@pytest.mark.extended
@LAWS
def test_the_hand_keeps_its_limits_whatever_is_drawn(law: JointLaw) -> None:
    over = []
    for seed in range(100, 108):
        loop = jumping(seed, law)
        loop.run(6)
        shares = shares_of(loop)
        assert max(shares["told speed"], shares["went speed"]) <= 1.0, (seed, shares)
        assert broken_limits(loop) == []
        over += [(seed, shares)] if max(shares.values()) > 1.0 else []
    # Near singular poses, joints that are fast while the hand is slow cannot brake as fast as the
    # arm's shape changes: their own accelerations come before the hand's.
    assert len(over) <= 1, over
    assert all(max(shares.values()) < 1.8 for _, shares in over)


@LAWS
def test_the_hand_keeps_its_limits_on_its_way_from_look_to_look(law: JointLaw) -> None:
    loop = Loop(to_and_fro(10), ServoSettings(joints=JointSettings(law=law)))
    point = np.array(to_and_fro(10)(0.0).translation)
    for offset in ([0.1, 0.3, 0.2, 0.3, 0.3, 0.6], [0.0, -0.3, 0.1, 0.0, -0.4, -0.7]):
        goal = goal_at(np.array(offset)) @ GOAL_FROM_OBJECT.inverse()
        led(loop, goal, point, 2.0)
    assert_kept(loop)


def led(loop: Loop, goal: Pose, point: Floats, seconds: float) -> None:
    """Lead a hand to a pose in the world, and keep the ticks."""
    end_s = loop.arm.time_s + seconds
    while loop.arm.time_s < end_s:
        state = loop.arm.state()
        command = loop.controller.go_to(state, goal, point)
        loop.ticks.append(loop._tick(state, command))
        loop.arm.command(command.velocities)


class JerkLimited(SerialArm):
    """An arm whose joints have a jerk limit, in rad/s³."""

    most = np.inf

    @property
    def joints(self) -> Joints:
        joints = super().joints
        return replace(joints, jerk=np.full(len(joints.names), self.most))


@LAWS
@pytest.mark.parametrize("jerk", tiered([10.0, 3.0, 1.0, 30.0, 50.0, 200.0]))
def test_joints_of_low_jerk_bring_the_hand_to_its_goal_all_the_same(
    law: JointLaw, jerk: float
) -> None:
    far = goal_at(np.array([0.1, 0.04, 0.05, 0.0, 0.0, 0.0]))
    loop = Loop(lambda _: far, ServoSettings(joints=JointSettings(law=law)))
    loop.arm = JerkLimited(read_arm(), PERIOD_S)
    loop.arm.most = jerk
    loop.controller = Controller(loop.arm, loop.settings)
    ticks = loop.run(10)
    assert shares_of(loop)["told speed"] <= 1.0
    commands = np.array([tick.command.velocities for tick in ticks])
    jerks = np.abs(np.diff(commands, n=2, axis=0)) / loop.arm.period_s**2
    assert jerks.max() <= jerk * (1.0 + 1e-6)
    errors = position_errors(ticks)
    assert errors.max() < 1.05 * errors[0], "it comes nearer, and does not run away"
    settled = errors[-125:].max()
    assert settled < (0.03 if jerk < 10.0 else 1e-3), f"{1e3 * settled:.1f} mm"

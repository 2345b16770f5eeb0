import math

import msgspec
import numpy as np
import pytest
from servo_loop import GOAL_FROM_OBJECT, WORLD_FROM_START, to_and_fro

from servoid._native import change_between
from servoid.errors import SimError
from servoid.servo.law.joints import PaperJoints
from servoid.servo.settings import JointSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm


def command(arm: SerialArm, velocities: np.ndarray, times: int) -> None:
    for _ in range(times):
        arm.command(velocities)


@pytest.mark.parametrize("links", ["openbionics", "jsi"])
def test_the_hand_starts_where_the_paper_starts_it_with_the_first_joint_at_0(links: str) -> None:
    arm = SerialArm(read_arm(links=links))
    positions = arm.state().positions
    assert positions[0] == 0
    error = change_between(arm.world_from_hand(positions), WORLD_FROM_START)
    np.testing.assert_allclose(error, 0, atol=1e-9)


def test_the_papers_whole_stroke_can_be_reached_with_the_first_joint_at_0() -> None:
    arm = SerialArm(read_arm())
    law = PaperJoints(arm, JointSettings(newton_steps=20))
    positions = arm.state().positions
    for time_s in np.linspace(0, 5, 11):
        goal = to_and_fro(10)(time_s) @ GOAL_FROM_OBJECT.inverse()
        positions = law.joints_at(goal, positions)
        error = change_between(arm.world_from_hand(positions), goal)
        np.testing.assert_allclose(error, 0, atol=1e-6)
        assert positions[0] == 0


def test_a_small_step_of_speed_is_answered_with_the_lag() -> None:
    arm = SerialArm(read_arm())
    wanted = np.full(10, 0.01)
    command(arm, wanted, 3)
    lags = np.repeat([0.02, 0.01], [7, 3])
    after = 3 * arm.period_s
    np.testing.assert_allclose(arm.state().velocities, wanted * (1 - np.exp(-after / lags)))


def test_speeds_grow_no_faster_than_the_acceleration_limits() -> None:
    arm = SerialArm(read_arm())
    before = arm.state().velocities
    for sign in (1.0, -1.0):
        for _ in range(40):
            arm.command(sign * arm.joints.speed)
            after = arm.state().velocities
            change = np.abs(after - before) / arm.period_s
            assert np.all(change <= arm.joints.acceleration * (1 + 1e-9))
            assert np.all(np.abs(after) <= arm.joints.speed)
            before = after


def test_motion_does_not_depend_on_how_often_the_same_command_is_repeated() -> None:
    coarse, fine = (SerialArm(read_arm(), period_s=period) for period in (0.032, 0.002))
    for sign in (1.0, -1.0, 0.2):
        command(coarse, sign * 0.8 * coarse.joints.speed, 2)
        command(fine, sign * 0.8 * fine.joints.speed, 32)
    np.testing.assert_allclose(coarse.state().positions, fine.state().positions, atol=1e-12)
    np.testing.assert_allclose(coarse.state().velocities, fine.state().velocities, atol=1e-12)


def test_a_start_that_cannot_be_reached_is_refused() -> None:
    arm = read_arm()
    far = msgspec.structs.replace(arm.start, world_from_hand=(1.0, 0, 0, 0, 3.0, 0, 0))
    with pytest.raises(SimError, match=r"\(3, 0, 0\) m cannot be reached"):
        SerialArm(msgspec.structs.replace(arm, start=far))


def test_lists_that_do_not_fit_each_other_are_refused() -> None:
    arm = read_arm()
    short = msgspec.structs.replace(arm.joints, speed_deg=(1.0,))
    with pytest.raises(SimError, match="10 joints are named, but speed_deg has 4 values"):
        SerialArm(msgspec.structs.replace(arm, joints=short))


@pytest.mark.parametrize("period_s", [0.0, -1.0, math.nan])
def test_a_period_must_be_positive(period_s: float) -> None:
    with pytest.raises(SimError, match="must be positive"):
        SerialArm(read_arm(), period_s=period_s)

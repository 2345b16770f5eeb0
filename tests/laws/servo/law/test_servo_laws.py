"""Laws of the parts of one control tick."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from servo_loop import WORLD_FROM_START

from servoid._native import (
    Moving,
    quaternion_error,
    seen_from_head,
    shifted_and_turned,
    stoppable_speed,
    twist_shares,
    twist_within,
)
from servoid.errors import MissingExtraError
from servoid.pose import Pose
from servoid.servo import JointState, Reason
from servoid.servo.keeping.bounds import Rows, Window
from servoid.servo.keeping.limiter import Limited, Limiter
from servoid.servo.keeping.workspace_limits import WorkspaceLimits, walls_of
from servoid.servo.law.gaze import fixation
from servoid.servo.law.hand import correction
from servoid.servo.law.ik import QuadraticJoints
from servoid.servo.law.joints import (
    HandSetpoint,
    JointSetpoint,
    PaperJoints,
    hand_weights,
    pseudo_inverse,
)
from servoid.servo.settings import HandSettings, JointSettings, SafetySettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm


@pytest.fixture
def arm() -> SerialArm:
    return SerialArm(read_arm())


def between(lower: np.ndarray, upper: np.ndarray) -> Window:
    causes = [[Reason.JOINT_SPEED] * len(lower)] * 2
    return Window(lower, upper, causes)


FREE = HandSettings(
    linear_speed=20.0, angular_speed=1e3, linear_acceleration=1e6, angular_acceleration=1e6
)


def limited(
    arm: SerialArm,
    setpoint: JointSetpoint,
    *,
    settings: HandSettings = FREE,
    last: np.ndarray | None = None,
    window: Window | None = None,
    walls: Rows | None = None,
) -> Limited:
    """Limit a setpoint of an arm in its present posture, by nothing that is left out."""
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    limiter = Limiter(arm.period_s, settings)
    bounds = limiter.bounds(
        jacobian,
        np.zeros(6) if last is None else last,
        window or between(np.full(7, -100.0), np.full(7, 100.0)),
        walls or Rows.none(7),
        1.0,
    )
    return limiter.nearest(setpoint, bounds)


@pytest.mark.parametrize("angle", [-3.0, -1.0, 0.2, 2.5])
def test_the_quaternion_error_points_along_the_short_way(angle: float) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    for whole_turns in (0.0, 2 * np.pi):
        turned = Pose.exp([0.0, 0.0, 0.0, *((angle + whole_turns) * axis)])
        error = quaternion_error(Moving.at_rest(turned))
        np.testing.assert_allclose(error, np.sin(angle / 2) * axis, atol=1e-12)


def test_the_hand_is_led_straight_to_its_goal() -> None:
    change = np.array([0.1, -0.05, 0.2, 0.0, 0.02, 0.01])
    goal = shifted_and_turned(WORLD_FROM_START, change)
    error = Moving.at_rest(WORLD_FROM_START.inverse() @ goal)
    settings = HandSettings()
    twist = correction(error, WORLD_FROM_START, settings)
    np.testing.assert_allclose(twist[:3], settings.position_gain * change[:3], atol=1e-12)
    np.testing.assert_allclose(twist[3:], settings.turn_gain * change[3:] / 2, atol=1e-5)


def test_the_rate_gains_damp_the_hands_own_motion() -> None:
    own = np.array([0.1, 0.2, -0.1, 0.3, -0.2, 0.1])
    error = Moving.from_twist(WORLD_FROM_START, own).inverse() @ Moving.at_rest(WORLD_FROM_START)
    settings = HandSettings()
    gains = np.repeat([settings.position_rate_gain, settings.turn_rate_gain], 3)
    twist = correction(error, WORLD_FROM_START, settings)
    np.testing.assert_allclose(twist, -gains * own, atol=1e-12)


def test_a_twist_is_shortened_in_its_direction() -> None:
    twist = np.array([3.0, 0.0, 4.0, 0.0, 0.1, 0.0])
    np.testing.assert_allclose(twist_within(twist, 1.0, 1.0), [0.6, 0, 0.8, 0, 0.1, 0])
    np.testing.assert_allclose(twist_shares(np.zeros(6), 1.0, 1.0), [1, 1])


@pytest.mark.parametrize("seed", range(3))
def test_a_hand_velocity_comes_near_its_wish_as_fast_as_the_hand_may_speed_up(
    arm: SerialArm, seed: int
) -> None:
    random = np.random.default_rng(seed)
    settings = HandSettings()
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    twist, wanted = np.zeros(6), random.uniform(-0.15, 0.15, 6)
    setpoint = JointSetpoint(pseudo_inverse(jacobian) @ wanted, hand_weights(jacobian, 0.3))
    step = settings.acceleration_share * settings.linear_acceleration * arm.period_s
    for _ in range(30):
        found = limited(arm, setpoint, settings=settings, last=twist)
        after = jacobian @ found.velocities
        left = np.linalg.norm(wanted[:3] - twist[:3])
        change = np.linalg.norm(after[:3] - twist[:3])
        assert change <= step
        assert change > min(0.99 * step, 0.99 * left) - 1e-8
        assert (Reason.HAND_ACCELERATION in found.reasons) == (left > step)
        twist = after
    np.testing.assert_allclose(twist, wanted, atol=1e-4)


def test_the_pseudo_inverse_is_the_least_motion_that_does_it(arm: SerialArm) -> None:
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    inverse = pseudo_inverse(jacobian)
    np.testing.assert_allclose(jacobian @ inverse, np.eye(6), atol=1e-6)
    np.testing.assert_allclose(inverse, np.linalg.pinv(jacobian), atol=1e-5)


def hand_setpoint(arm: SerialArm, twist: np.ndarray) -> HandSetpoint:
    return HandSetpoint(twist, arm.world_from_hand(arm.state().positions))


@pytest.mark.parametrize("law", [PaperJoints, QuadraticJoints])
def test_joint_speeds_give_the_wanted_hand_velocity(
    arm: SerialArm, law: type[PaperJoints] | type[QuadraticJoints]
) -> None:
    twist = np.array([0.05, -0.1, 0.02, 0.1, 0.05, -0.1])
    state = arm.state()
    jacobian = arm.jacobian(state.positions)[:, :7]
    setpoint = law(arm, JointSettings()).setpoint(state, jacobian, hand_setpoint(arm, twist))
    np.testing.assert_allclose(jacobian @ setpoint.velocities, twist, atol=1e-5)
    found = limited(arm, setpoint)
    np.testing.assert_array_equal(found.velocities, setpoint.velocities)
    assert found.reasons == frozenset()


@pytest.mark.parametrize("law", [PaperJoints, QuadraticJoints])
def test_what_is_told_is_the_nearest_to_the_wish_inside_all_bounds(
    arm: SerialArm, law: type[PaperJoints] | type[QuadraticJoints]
) -> None:
    random = np.random.default_rng(4)
    state = arm.state()
    jacobian = arm.jacobian(state.positions)[:, :7]
    asked = law(arm, JointSettings())
    settings = HandSettings(linear_acceleration=15.0, angular_acceleration=60.0)
    for _ in range(20):
        lower = random.uniform(-0.3, 0.05, 7)
        window = between(lower, lower + random.uniform(0.1, 0.4, 7))
        last = jacobian @ (0.5 * (window.lower + window.upper))
        normal = jacobian[:3].T @ random.normal(size=3)
        most = np.array([normal @ (0.5 * (window.lower + window.upper)) + 0.01])
        walls = Rows(normal[None], np.array([-np.inf]), most, (Reason.WORKSPACE,))
        setpoint = asked.setpoint(state, jacobian, hand_setpoint(arm, random.uniform(-0.3, 0.3, 6)))
        bounds = Limiter(arm.period_s, settings).bounds(jacobian, last, window, walls, 1.0)
        found = Limiter(arm.period_s, settings).nearest(setpoint, bounds)
        at_most = Rows(walls.matrix, walls.lower, walls.upper + 1e-5, walls.reasons)
        assert replace(bounds, rows=at_most).hold(found.velocities)
        assert not bounds.hold(np.full(len(found.velocities), np.nan))

        def cost(velocities: np.ndarray, setpoint: JointSetpoint = setpoint) -> float:
            off = velocities - setpoint.velocities
            return float(off @ setpoint.weights @ off)

        others = random.uniform(window.lower, window.upper, (300, 7))
        nearby = window.bounded(found.velocities + random.normal(0, 0.003, (300, 7)))
        allowed = [one for one in (*others, *nearby) if bounds.hold(one)]
        assert len(allowed) > 10
        assert cost(found.velocities) <= min(cost(one) for one in allowed) + 1e-4


def test_bounds_that_act_are_named(arm: SerialArm) -> None:
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    weights = hand_weights(jacobian, 0.3)
    ahead = pseudo_inverse(jacobian) @ np.array([0.4, 0.0, 0.0, 0.0, 0.0, 0.0])
    slow = HandSettings(linear_speed=0.1, linear_acceleration=1e6, angular_acceleration=1e6)
    wall = Rows(jacobian[:1], np.array([-0.1]), np.array([0.1]), (Reason.WORKSPACE,))
    held = between(np.full(7, -0.01), np.full(7, 0.01))
    assert limited(arm, JointSetpoint(ahead, weights)).reasons == frozenset()
    for bound, reason in (
        ({"settings": slow}, Reason.HAND_SPEED),
        ({"walls": wall}, Reason.WORKSPACE),
        ({"window": held}, Reason.JOINT_SPEED),
        ({"settings": HandSettings()}, Reason.HAND_ACCELERATION),
    ):
        assert limited(arm, JointSetpoint(ahead, weights), **bound).reasons == {reason}


def test_bounds_that_leave_the_hand_alone_are_not_named(arm: SerialArm) -> None:
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    free = np.linalg.svd(jacobian)[2][6]
    held = between(np.full(7, -0.01), np.full(7, 0.01))
    found = limited(arm, JointSetpoint(0.03 * free, hand_weights(jacobian, 0.3)), window=held)
    assert np.abs(found.velocities).max() > 0.009
    assert found.reasons == frozenset()


def test_free_motion_leads_back_to_the_first_posture(arm: SerialArm) -> None:
    law = QuadraticJoints(arm, JointSettings())
    state = arm.state()
    jacobian = arm.jacobian(state.positions)[:, :7]
    free = np.linalg.svd(jacobian)[2][6]
    moved = JointState(0.0, state.positions + 0.01 * np.append(free, [0, 0, 0]), state.velocities)
    velocities = law.setpoint(moved, jacobian, hand_setpoint(arm, np.zeros(6))).velocities
    np.testing.assert_allclose(velocities, -0.01 * JointSettings().posture_gain * free, atol=1e-6)


def test_near_a_singular_pose_the_quadratic_program_stays_slow(arm: SerialArm) -> None:
    straight = np.zeros(10)
    state = JointState(0.0, straight, np.zeros(10))
    jacobian = arm.jacobian(straight)[:, :7]
    assert np.linalg.svd(jacobian)[1][-1] < 1e-9
    settings = JointSettings()
    law = QuadraticJoints(arm, settings)
    for twist in 0.1 * np.eye(6):
        velocities = law.setpoint(state, jacobian, hand_setpoint(arm, twist)).velocities
        assert np.abs(velocities).max() < 0.1 / settings.damping + 0.5


def test_a_missing_solver_is_named(arm: SerialArm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "daqp", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[servo\]'"):
        Limiter(arm.period_s, HandSettings())


@pytest.mark.parametrize("room", [0.0, 1e-4, 0.01, 0.5, 3.0])
def test_a_stoppable_speed_stops_in_time(room: float) -> None:
    period_s, reaction_s, deceleration = 0.002, 0.03, 2.0
    left, last = room, None
    for _ in range(5000):
        speed = float(stoppable_speed(np.array(left), deceleration, reaction_s))
        assert last is None or last - speed <= deceleration * period_s * (1 + 1e-9)
        left, last = left - speed * period_s, speed
    assert 0 <= left < 1e-3 * max(room, 1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_both_eyes_meet_the_point_that_they_fixate(arm: SerialArm, seed: int) -> None:
    random = np.random.default_rng(seed)
    positions = arm.state().positions
    point = (arm.world_from_hand(positions) @ arm.eyes.hand_from_head).transform(
        random.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 0.8])[None]
    )[0]
    hand = arm.world_from_hand(positions)
    in_head, _ = seen_from_head(hand, arm.eyes.hand_from_head, np.zeros(6), point, np.zeros(3))
    eyes = arm.eyes
    positions[[eyes.tilt, eyes.pan_left, eyes.pan_right]] = fixation(
        eyes.half_baseline, in_head, np.zeros(3)
    ).angles
    for world_from_eye in arm.world_from_cameras(positions):
        x, y, z = (world_from_eye.inverse()).transform(point[None])[0]
        assert np.hypot(x, y) < 1e-12 < z


@pytest.mark.parametrize("seed", range(5))
def test_rates_of_the_gaze_are_the_slopes_of_its_angles(arm: SerialArm, seed: int) -> None:
    random = np.random.default_rng(seed)
    hand = arm.world_from_hand(arm.state().positions)
    point = hand.transform(random.uniform([-0.2, -0.2, 0.3], [0.2, 0.2, 0.8])[None])[0]
    velocity, hand_twist = random.normal(size=3), random.normal(size=6)

    def gaze(time_s: float) -> np.ndarray:
        moved = shifted_and_turned(hand, time_s * hand_twist)
        at = point + time_s * velocity
        seen = seen_from_head(moved, arm.eyes.hand_from_head, hand_twist, at, velocity)
        return fixation(arm.eyes.half_baseline, *seen).angles

    seen = seen_from_head(hand, arm.eyes.hand_from_head, hand_twist, point, velocity)
    slopes = (gaze(1e-5) - gaze(-1e-5)) / 2e-5
    np.testing.assert_allclose(fixation(arm.eyes.half_baseline, *seen).rates, slopes, atol=1e-6)


def test_a_hand_outside_its_workspace_may_only_come_back(arm: SerialArm) -> None:
    box = SafetySettings(workspace_lower=(-1, -1, 0), workspace_upper=(1, 1, 1))
    # Its last velocity leads back already, so that no wall asks for more than braking takes.
    back = np.array([-1.0, 0.0, 1.0])
    workspace = WorkspaceLimits(box, 0.03, arm.period_s)
    limits = workspace.velocity_limits(
        np.array([1.1, 0.0, -0.1]), back, np.array([0.0, 5.0, 0.0]), np.zeros(3)
    )
    assert limits.upper[0] < 0 < limits.lower[2]
    jacobian = arm.jacobian(arm.state().positions)[:, :7]
    out = pseudo_inverse(jacobian) @ np.array([0.5, 0.2, -0.5, 0, 0, 0])
    setpoint = JointSetpoint(out, hand_weights(jacobian, 0.3))
    found = limited(arm, setpoint, walls=walls_of(limits, jacobian))
    twist = jacobian @ found.velocities
    assert twist[0] < 0 < twist[2] and twist[1] == pytest.approx(0.2, abs=1e-3)
    assert found.reasons == {Reason.WORKSPACE}


def test_no_wall_asks_for_more_than_braking_takes() -> None:
    workspace = WorkspaceLimits(SafetySettings(workspace_upper=(1, 1, 1)), 0.03, 0.01)
    fast = np.array([0.4, 0.0, 0.0])
    limits = workspace.velocity_limits(
        np.array([1.1, 0.0, 0.5]), fast, np.array([1.2, 0.0, 0.5]), np.zeros(3)
    )
    braking = SafetySettings().braking * 0.01
    assert limits.upper[0] == pytest.approx(0.4 - braking)
    assert limits.closing == pytest.approx(0.4 - braking)

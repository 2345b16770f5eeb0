"""Laws of what a controller is given: what it cannot use is refused in words, by a ServoError."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import GOAL_FROM_OBJECT, PERIOD_S, WORLD_FROM_OBJECT

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo import Controller, JointState, RememberingArm
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

ESTIMATES: dict[str, tuple[dict[str, Any], str]] = {
    "a list as pose": (
        {"world_from_object": [1, 2, 3]},
        "world_from_object must be a servoid.pose.Pose, but is list",
    ),
    "a matrix as pose": ({"world_from_object": np.eye(4)}, r"but is ndarray of shape \(4, 4\)"),
    "no time": ({"time_s": None}, "time_s must be a number, but is None"),
    "a text as confidence": ({"confidence": "high"}, "confidence must be a number, but is 'high'"),
    "a percentage as confidence": (
        {"confidence": 5.0},
        "confidence is 5; it is a probability, 0 to 1: divide percentages by 100",
    ),
    "a negative confidence": (
        {"confidence": -0.5},
        "confidence is -0.5; it is a probability, 0 to 1$",
    ),
    "an unknown status": ({"status": "TRACKING"}, "one of tracking, searching, lost, but is 'TR"),
    "correlations above 1": (
        {"covariance": np.eye(6) + 2.0 * np.eye(6)[::-1]},
        "must have no direction of a variance below 0, but its least eigenvalue is -1;",
    ),
    "a small covariance": (
        {"covariance": np.eye(3)},
        r"covariance must be an array \(6, 6\).* but is ndarray of shape \(3, 3\)",
    ),
    "no covariance": ({"covariance": None}, r"covariance must be an array .*NoneType"),
    "a negative covariance": ({"covariance": -np.eye(6)}, "no variance below 0 .* but has -1"),
    "narrow motions": (
        {"unobservable": np.ones((2, 3))},
        r"unobservable must be an array \(n, 6\)",
    ),
    "a list of motions": ({"unobservable": []}, r"unobservable must be an array .* but is list"),
}
STATES: dict[str, tuple[Callable[[JointState], Any], str]] = {
    "no state": (lambda _: None, "state must be a servoid.servo.JointState, but is NoneType"),
    "a tuple": (
        lambda state: (state.time_s, state.positions, state.velocities),
        "state must be a servoid.servo.JointState, but is tuple",
    ),
    "one position too few": (
        lambda state: replace(state, positions=state.positions[:-1]),
        "JointState.positions has 9 numbers, but the arm has 10 joints: give one for each of s1",
    ),
    "one speed too many": (
        lambda state: replace(state, velocities=np.zeros(11)),
        "JointState.velocities has 11 numbers, but the arm has 10 joints",
    ),
    "no time": (
        lambda state: replace(state, time_s=None),
        "JointState.time_s must be a number, but is None",
    ),
    "a masked position": (
        lambda state: replace(
            state, positions=np.ma.masked_array(state.positions, [True] + 9 * [False])
        ),
        "JointState.positions holds masked values; where a sensor has none, give NaN",
    ),
    "complex positions": (
        lambda state: replace(state, positions=state.positions + 0j),
        r"JointState.positions must be a row of numbers, but is array\(\[.*j",
    ),
    "texts as speeds": (
        lambda state: replace(state, velocities=10 * ["0"]),
        r"JointState.velocities must be a row of numbers, but is \['0', '0'",
    ),
    "a stop that is not told": (
        lambda state: replace(state, stopped=None),
        "JointState.stopped must be True or False, but is None; if the driver does not tell",
    ),
    "a text as stop": (
        lambda state: replace(state, stopped="no"),
        "JointState.stopped must be True or False, but is 'no'",
    ),
}
FULL = np.full(10, 1.0)
LIMITS: dict[str, tuple[dict[str, Any], str]] = {
    "one name twice": (
        {"names": ("s1", "s2", "s3", "e1", "s2", "w1", "w2", "tilt", "left", "right")},
        "Joints.names has 's2' 2 times; give each joint a name of its own",
    ),
    "lower limits in degrees": (
        {"lower": -177.0 * FULL},
        r"Joints.lower of joint 's1' is -177 rad, and more than 12.5664 rad is not plausible; "
        r"angles are in radians: if it is in degrees, write -3.08923; if it turns without an end",
    ),
    "upper limits in degrees": (
        {"upper": 90.0 * FULL},
        "Joints.upper of joint 's1' is 90 rad, .* if it is in degrees, write 1.5708",
    ),
    "speeds in degrees": (
        {"speed": 57.0 * FULL},
        "Joints.speed of joint 's1' is 57 rad/s, .* degrees per second, write 0.994838",
    ),
    "exchanged limits": (
        {"lower": 3.0 * FULL, "upper": -3.0 * FULL},
        "joint 's1' has the lower limit 3 and the upper limit -3; the lower one must be below",
    ),
    "unknown limits": (
        {"lower": np.nan * FULL},
        "joint 's1' has the lower limit nan and the upper",
    ),
    "an endless acceleration": (
        {"acceleration": np.inf * FULL},
        "Joints.acceleration of joint 's1' is inf; give the finite number of its data sheet",
    ),
    "an unknown acceleration": (
        {"acceleration": np.nan * FULL},
        "Joints.acceleration of joint 's1' must be a number above 0, but is nan",
    ),
    "no jerk at all": (
        {"jerk": 0.0 * FULL},
        "Joints.jerk of joint 's1' must be .* above 0, but is 0",
    ),
    "a negative speed": (
        {"speed": -FULL},
        "Joints.speed of joint 's1' must be 0 or more, but is -1",
    ),
    "more joints of the hand": (
        {"hand_count": 11},
        "Joints.hand_count must be a whole number from 1 to 10, the number of joints, but is 11",
    ),
}
EYES: dict[str, tuple[dict[str, Any], str]] = {
    "a pan that moves the hand": (
        {"pan_right": 0},
        "Arm.eyes.pan_right is 0, but must be the index of a camera's joint, 7 to 9: the first 7",
    ),
    "a pan that is no joint": (
        {"pan_right": 20},
        "Arm.eyes.pan_right is 20, but must be .* 7 to 9",
    ),
    "a tilt by its name": ({"tilt": "tilt"}, "Arm.eyes.tilt is 'tilt', but must be the index"),
    "a pan that is the tilt": (
        {"pan_left": 7},
        "Arm.eyes uses a joint twice: tilt 7, pan_left 7, pan_right 9; give each its own index",
    ),
    "exchanged cameras": (
        {"half_baseline": -0.06},
        "half_baseline must be 0 m or more, but is -0.06",
    ),
}


def pa10() -> SerialArm:
    return SerialArm(read_arm("pa10"), PERIOD_S)


@pytest.mark.parametrize("case", ESTIMATES)
def test_an_estimate_that_cannot_be_used_is_refused_in_words(case: str) -> None:
    changed, words = ESTIMATES[case]
    controller = Controller(pa10())
    with pytest.raises(ServoError, match=words):
        controller.see(None, replace(FakeEstimate(0.0, WORLD_FROM_OBJECT), **changed))
    controller.see(None, FakeEstimate(0.0, WORLD_FROM_OBJECT))


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int64])
def test_an_estimate_of_other_numbers_is_followed_as_one_of_float64(kind: type) -> None:
    turn = np.array([[0, 0, 0, 0, 0, 1]])
    commands = []
    for dtype in (np.float64, kind):
        arm = pa10()
        controller = Controller(arm)
        for _ in range(20):
            estimate = replace(
                FakeEstimate(arm.time_s, WORLD_FROM_OBJECT, confidence=1.0),
                covariance=np.eye(6).astype(dtype),
                unobservable=turn.astype(dtype),
            )
            controller.see(None, estimate)
            commands.append(controller.command(arm.state(), GOAL_FROM_OBJECT).velocities)
            arm.command(commands[-1])
    assert np.array_equal(commands[:20], commands[20:])


def test_an_estimate_without_a_member_is_refused_by_its_name() -> None:
    @dataclass
    class Bare:
        time_s: float
        world_from_object: Pose

    words = "an estimate needs .* but Bare has no confidence, status, located, covariance, unobs"
    with pytest.raises(ServoError, match=words):
        Controller(pa10()).see(None, Bare(0.0, Pose.identity()))  # type: ignore[arg-type]


@pytest.mark.parametrize("case", STATES)
def test_a_joint_state_that_cannot_be_used_is_refused_in_words(case: str) -> None:
    changed, words = STATES[case]
    arm = pa10()
    controller, state, place = Controller(arm), arm.state(), Pose.identity()
    asked = [
        lambda: controller.command(changed(state), GOAL_FROM_OBJECT),
        lambda: controller.go_to(changed(state), place, np.zeros(3)),
    ]
    if case != "no state":  # without one, joints are braked along the last command
        asked.append(lambda: controller.rest(changed(state)))
    for ask in asked:
        with pytest.raises(ServoError, match=words):
            ask()


@pytest.mark.parametrize("case", STATES)
def test_an_arm_whose_state_cannot_be_used_is_refused_in_words(case: str) -> None:
    changed, words = STATES[case]

    class Own(SerialArm):
        def state(self) -> Any:
            return changed(super().state())

    for take in (Controller, RememberingArm):
        with pytest.raises(ServoError, match=words):
            take(Own(read_arm("pa10"), PERIOD_S))


@pytest.mark.parametrize("given", [np.eye(4), [0.0, 0.0, 0.5], "home"])
def test_a_goal_that_is_no_pose_is_refused_in_words(given: Any) -> None:
    arm = pa10()
    controller, state = Controller(arm), arm.state()
    with pytest.raises(ServoError, match=r"goal_from_object must be a servoid\.pose\.Pose, but is"):
        controller.command(state, given)
    with pytest.raises(ServoError, match=r"world_from_goal must be a servoid\.pose\.Pose, but is"):
        controller.go_to(state, given, np.zeros(3))


@pytest.mark.parametrize("case", LIMITS)
def test_limits_of_joints_that_cannot_be_true_are_refused_in_words(case: str) -> None:
    changed, words = LIMITS[case]
    joints = pa10().joints
    with pytest.raises(ServoError, match=words):
        replace(joints, **changed)
    replace(joints, lower=-np.inf * FULL, upper=np.inf * FULL)  # they turn without an end


@pytest.mark.parametrize("case", EYES)
def test_cameras_without_joints_of_their_own_are_refused_before_the_arm_moves(case: str) -> None:
    changed, words = EYES[case]

    class Own(SerialArm):
        @property
        def eyes(self) -> Any:
            return replace(super().eyes, **changed)  # type: ignore[type-var]

    with pytest.raises(ServoError, match=words):
        Controller(Own(read_arm("pa10"), PERIOD_S))


def test_a_control_period_in_milliseconds_is_refused() -> None:
    words = r"Arm.period_s is 8 s, and more than 0.5 s .* if it is in milliseconds, write 0.008"
    with pytest.raises(ServoError, match=words):
        Controller(SerialArm(read_arm("pa10"), 8.0))


class NarrowArm(SerialArm):
    """An arm whose Jacobian has the hand's joints only."""

    def jacobian(self, positions: Any) -> Any:
        return super().jacobian(positions)[:, :7]


def test_what_is_no_arm_or_no_settings_is_refused_in_words() -> None:
    with pytest.raises(ServoError, match=r"an arm needs joints, .* but str has no joints, eyes"):
        Controller("pa10")  # type: ignore[arg-type]
    with pytest.raises(ServoError, match=r"settings must be servoid\.servo\.ServoSettings .* dict"):
        Controller(pa10(), {"law": "qp"})  # type: ignore[arg-type]


def test_an_arm_whose_jacobian_lacks_joints_is_refused_in_words() -> None:
    arm = NarrowArm(read_arm("pa10"), PERIOD_S)
    words = r"Arm.jacobian must return an array \(6, 10\), but its shape is \(6, 7\)"
    with pytest.raises(ServoError, match=words):
        Controller(arm).command(arm.state(), GOAL_FROM_OBJECT)

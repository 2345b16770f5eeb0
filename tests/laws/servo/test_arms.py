"""What every arm must do, simulated or real; a new one is one more line in `ARMS`."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from servoid._native import change_between
from servoid.errors import ServoError
from servoid.servo import Arm, RememberingArm
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm


def in_a_world(turning_eyes: bool) -> Arm:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    from servoid.sim.world import ArmSettings, World, WorldSettings

    arm = ArmSettings(turning_eyes=turning_eyes)
    return World(WorldSettings(arm=arm, background="plain", ideal=True)).arm


@cache
def shown_arm() -> type[Any]:
    """Return the class of an arm that the page about arms shows."""
    page = (Path(__file__).parents[3] / "docs" / "howto" / "own_arm.md").read_text("utf-8")
    blocks: list[str] = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    [shown] = [block for block in blocks if "class MyArm" in block]
    names: dict[str, Any] = {}
    exec(shown, names)
    return names["MyArm"]


ARMS: dict[str, Callable[[], Arm]] = {
    "serial": lambda: SerialArm(read_arm()),
    "serial with other links": lambda: SerialArm(read_arm(links="jsi"), period_s=0.002),
    "remembered": lambda: RememberingArm(SerialArm(read_arm())),
    "on the page about arms": lambda: shown_arm()(),
    "in a world": lambda: in_a_world(turning_eyes=True),
    "in a world, with fixed eyes": lambda: in_a_world(turning_eyes=False),
}


@pytest.fixture(scope="module", params=ARMS.values(), ids=ARMS.keys())
def arm(request: pytest.FixtureRequest) -> Arm:
    """Return an arm that all tests share which do not move it."""
    return request.param()


@pytest.fixture(params=ARMS.values(), ids=ARMS.keys())
def own_arm(request: pytest.FixtureRequest) -> Arm:
    """Return an arm that a test may move."""
    return request.param()


def random_positions(arm: Arm, count: int = 10) -> list[np.ndarray]:
    random = np.random.default_rng(3)
    lower, upper = np.maximum(arm.joints.lower, -3.0), np.minimum(arm.joints.upper, 3.0)
    return [random.uniform(lower, upper) for _ in range(count)]


def test_it_is_an_arm(arm: Arm) -> None:
    assert isinstance(arm, Arm)
    assert arm.period_s > 0


def test_every_joint_has_a_name_and_limits(arm: Arm) -> None:
    joints = arm.joints
    size = len(joints.names)
    assert len(set(joints.names)) == size >= joints.hand_count > 0
    limits = (joints.lower, joints.upper, joints.speed, joints.acceleration)
    assert [values.shape for values in limits] == [(size,)] * 4
    assert np.all(joints.lower < joints.upper)
    assert np.all(joints.speed > 0) and np.all(joints.acceleration > 0)


def test_it_starts_at_rest_inside_its_limits(arm: Arm) -> None:
    state = arm.state()
    assert np.all(state.velocities == 0)
    assert np.all((state.positions >= arm.joints.lower) & (state.positions <= arm.joints.upper))


def test_the_jacobian_is_the_slope_of_the_hands_pose(arm: Arm) -> None:
    step = 1e-6
    for positions in random_positions(arm):
        slope = np.empty((6, len(positions)))
        for joint in range(len(positions)):
            aside = step * np.eye(len(positions))[joint]
            before = arm.world_from_hand(positions - aside)
            after = arm.world_from_hand(positions + aside)
            slope[:, joint] = change_between(before, after) / (2 * step)
        np.testing.assert_allclose(arm.jacobian(positions), slope, atol=1e-8)


def test_joints_of_the_eyes_do_not_move_the_hand(arm: Arm) -> None:
    for positions in random_positions(arm, 3):
        assert np.all(arm.jacobian(positions)[:, arm.joints.hand_count :] == 0)


def test_eyes_sit_half_a_baseline_beside_the_head(arm: Arm) -> None:
    if arm.eyes is None:
        pytest.skip("this arm's cameras are fixed to its hand")
    for positions in random_positions(arm, 3):
        world_from_head = arm.world_from_hand(positions) @ arm.eyes.hand_from_head
        places = [
            (world_from_head.inverse() @ pose).translation
            for pose in arm.world_from_cameras(positions)
        ]
        half = arm.eyes.half_baseline
        np.testing.assert_allclose(places, [[-half, 0, 0], [half, 0, 0]], atol=1e-12)


def test_a_positive_tilt_looks_down_and_a_positive_pan_to_the_right(arm: Arm) -> None:
    if arm.eyes is None:
        pytest.skip("this arm's cameras are fixed to its hand")
    eyes = arm.eyes
    positions = arm.state().positions
    positions[[eyes.tilt, eyes.pan_left, eyes.pan_right]] = 0.3, 0.2, -0.1
    world_from_head = arm.world_from_hand(positions) @ eyes.hand_from_head
    for pose, pan in zip(arm.world_from_cameras(positions), (0.2, -0.1), strict=True):
        axis = (world_from_head.inverse() @ pose).matrix()[:3, 2]
        ahead = np.cos(pan)
        expected = [np.sin(pan), np.sin(0.3) * ahead, np.cos(0.3) * ahead]
        np.testing.assert_allclose(axis, expected, atol=1e-12)


def test_time_passes_by_one_period_with_each_command(own_arm: Arm) -> None:
    times = []
    for _ in range(5):
        times.append(own_arm.state().time_s)
        own_arm.command(np.zeros(len(own_arm.joints.names)))
    np.testing.assert_allclose(np.diff(times), own_arm.period_s, rtol=1e-6)


def test_joints_reach_the_speed_that_they_are_told(own_arm: Arm) -> None:
    before = own_arm.state().positions
    wanted = 0.1 * np.resize([1.0, -1.0], len(before))
    for _ in range(int(0.5 / own_arm.period_s)):
        own_arm.command(wanted)
    state = own_arm.state()
    np.testing.assert_allclose(state.velocities, wanted, atol=0.005)
    assert np.all((state.positions - before) * np.sign(wanted) > 0.03)


def test_joints_stop_at_their_limits(own_arm: Arm) -> None:
    for _ in range(int(12.0 / own_arm.period_s)):
        own_arm.command(own_arm.joints.speed)
    state = own_arm.state()
    assert np.all(state.positions <= own_arm.joints.upper + 1e-3)
    np.testing.assert_allclose(state.velocities, 0, atol=1e-3)


@pytest.mark.parametrize("wrong", [[0.0], [np.nan] * 10, [np.inf] * 10])
def test_speeds_that_are_no_speeds_are_refused(arm: Arm, wrong: list[float]) -> None:
    with pytest.raises(ServoError, match="finite joint speeds are needed"):
        arm.command(np.array(wrong))


def test_a_returned_state_is_a_copy(arm: Arm) -> None:
    arm.state().positions[:] = 9.0
    assert not np.any(arm.state().positions == 9.0)

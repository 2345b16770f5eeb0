import numpy as np
import pytest
from servo_loop import WORLD_FROM_OBJECT, WORLD_FROM_START

from servoid._native import change_between, shifted_and_turned
from servoid.pose import Pose
from servoid.servo.law import reach
from servoid.servo.law.reach import reached
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm


@pytest.fixture(scope="module")
def arm() -> SerialArm:
    return SerialArm(read_arm())


@pytest.mark.parametrize("seed", range(20))
def test_joints_that_are_found_hold_the_hand_at_its_goal(arm: SerialArm, seed: int) -> None:
    offset = np.random.default_rng(seed).uniform(-1, 1, 6) * np.repeat([0.12, 0.4], 3)
    goal = shifted_and_turned(WORLD_FROM_START, offset)
    start = arm.state().positions
    found = reached(arm, goal, start)
    assert found is not None
    np.testing.assert_allclose(change_between(arm.world_from_hand(found), goal), 0, atol=1e-6)
    assert np.all((found >= arm.joints.lower) & (found <= arm.joints.upper))
    assert np.array_equal(found[7:], start[7:])


def test_joints_that_are_not_free_do_not_turn(arm: SerialArm) -> None:
    goal = shifted_and_turned(WORLD_FROM_START, np.array([0.0, 0.1, 0.05, 0.1, 0.0, 0.1]))
    found = reached(arm, goal, arm.state().positions, slice(1, 7))
    assert found is not None and found[0] == 0


def test_what_lies_beyond_the_arm_is_not_reached(arm: SerialArm) -> None:
    assert reached(arm, WORLD_FROM_OBJECT, arm.state().positions) is None
    far = Pose.from_parts([3.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    assert reached(arm, far, arm.state().positions) is None


def test_only_ways_that_lead_nowhere_are_given_up_early(
    arm: SerialArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(4)
    lower, upper = np.maximum(arm.joints.lower, -3.0), np.minimum(arm.joints.upper, 3.0)
    ways = [
        (arm.world_from_hand(random.uniform(lower, upper)), random.uniform(lower, upper))
        for _ in range(30)
    ]
    steps: list[int] = []
    step = reach.stepped

    def counted(*way: object) -> object:
        steps.append(1)
        return step(*way)  # type: ignore

    monkeypatch.setattr(reach, "stepped", counted)
    early, early_steps = [reached(arm, *way) for way in ways], len(steps)
    monkeypatch.setattr(reach, "_STALLED", 0.0)
    late, late_steps = [reached(arm, *way) for way in ways], len(steps) - early_steps
    assert 5 < sum(found is None for found in late) < 25
    for found, expected in zip(early, late, strict=True):
        assert np.array_equal(found, expected) if expected is not None else found is None
    assert early_steps < late_steps

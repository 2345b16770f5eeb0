from collections.abc import Callable

import numpy as np
import pytest

from servoid._native import Moving, change_between, shifted_and_turned
from servoid.pose import Pose
from servoid.servo.law.hand import goal_error

STEP = 1e-4
Path = Callable[[float], Pose]


def path(seed: int) -> Path:
    """Make a smooth path of a pose."""
    random = np.random.default_rng(seed)
    start = Pose.exp(random.uniform(-1, 1, 6).tolist())
    sizes, speeds = random.uniform(-1, 1, (2, 6))

    def pose(time_s: float) -> Pose:
        return start @ Pose.exp((sizes * np.sin(speeds * time_s + 1)).tolist())

    return pose


def moving(pose: Path, time_s: float) -> Moving:
    """Make what a path does at a time, by differences of poses alone."""
    before, now, after = (pose(time_s + step) for step in (-STEP, 0.0, STEP))
    twist = change_between(before, after) / (2 * STEP)
    late, early = change_between(now, after) / STEP, change_between(before, now) / STEP
    return Moving.from_twist(now, twist, (late - early) / STEP)


def differences(pose: Path, time_s: float) -> tuple[np.ndarray, np.ndarray]:
    before, now, after = (pose(time_s + step).matrix() for step in (-STEP, 0.0, STEP))
    return (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2


def agree(found: Moving, pose: Path, time_s: float) -> None:
    first, second = differences(pose, time_s)
    np.testing.assert_allclose(found.matrix, pose(time_s).matrix(), atol=1e-12)
    np.testing.assert_allclose(found.first, first, atol=1e-6)
    np.testing.assert_allclose(found.second, second, atol=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_derivatives_from_twists_are_those_of_the_matrices(seed: int) -> None:
    agree(moving(path(seed), 0.3), path(seed), 0.3)


@pytest.mark.parametrize("seed", range(5))
def test_the_inverse_and_the_product_have_the_right_derivatives(seed: int) -> None:
    a, b = path(seed), path(seed + 50)
    agree(moving(a, 0.3).inverse(), lambda time_s: a(time_s).inverse(), 0.3)
    agree(moving(a, 0.3) @ moving(b, 0.3), lambda time_s: a(time_s) @ b(time_s), 0.3)


@pytest.mark.parametrize("seed", range(5))
def test_the_pose_error_of_the_hand_has_the_right_derivatives(seed: int) -> None:
    hand, target, goal = path(seed), path(seed + 20), path(seed + 40)
    error = goal_error(*(moving(one, 0.7) for one in (hand, target, goal)))
    agree(
        error,
        lambda time_s: hand(time_s).inverse() @ target(time_s) @ goal(time_s).inverse(),
        0.7,
    )


def test_the_pose_error_is_nothing_where_the_hand_is_at_its_goal() -> None:
    hand, goal = path(1)(0), path(2)(0)
    rest = [Moving.at_rest(pose) for pose in (hand, hand @ goal, goal)]
    error = goal_error(*rest)
    np.testing.assert_allclose(error.matrix, np.eye(4), atol=1e-12)
    assert not np.any(error.first) and not np.any(error.second)


def test_a_twist_is_returned_as_it_was_given() -> None:
    twist = np.array([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])
    np.testing.assert_allclose(Moving.from_twist(path(3)(0), twist).twist, twist, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_change_leads_from_one_pose_to_the_other(seed: int) -> None:
    before, after = path(seed)(0), path(seed + 7)(0)
    reached = shifted_and_turned(before, change_between(before, after))
    np.testing.assert_allclose(reached.matrix(), after.matrix(), atol=1e-12)

"""What the core computes of a control tick refuses arrays that do not fit, in words."""

from collections.abc import Callable

import numpy as np
import pytest

from servoid import _native
from servoid.errors import PoseError, ServoError
from servoid.pose import Pose

HERE = Pose.identity()
CHAIN = _native.Chain([(0.0, 0.1)] * 7, HERE)
LIMITS = _native.JointLimits([np.ones(3)] * 5, 2, 0.008, 0.02)
HAND = _native.HandLimits((1.0, 1.0), (0.1, 0.1), 0.008, 0.0)
BALLS = HAND.balls(np.ones((6, 7)), np.zeros(6), 1.0)
ROOM = _native.Workspace(
    ([-1.0] * 3, [1.0] * 3), least_distance=0.1, braking=1.0, reaction_s=0.1, period_s=0.008
)
LAW = _native.QuadraticLaw(np.zeros(7), 1.0, 0.3, 0.05, 0.02)

REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "a twist": (
        lambda: _native.Moving.from_twist(HERE, np.zeros(5)),
        r"a twist must be 6 numbers \(linear, angular\), but an array \(5,\) of float64 was given",
    ),
    "a change": (lambda: _native.shifted_and_turned(HERE, [0.0] * 7), "a change must be 6 numbers"),
    "lengths of a twist": (
        lambda: _native.twist_within(np.zeros((2, 3)), 1.0, 1.0),
        "a twist must be 6 numbers",
    ),
    "a point": (
        lambda: _native.fixation(0.1, np.zeros(2), np.zeros(3)),
        r"a point in the head must be 3 numbers \(x, y, z\)",
    ),
    "a chain without links": (lambda: _native.Chain([], HERE), "needs a link at least"),
    "angles of a chain": (
        lambda: CHAIN.jacobian(np.zeros(6)),
        "a chain of 7 joints needs an angle for each of them, but 6 were given",
    ),
    "angles in rows": (
        lambda: CHAIN.world_from_hand(np.zeros((1, 7))),
        "joint angles must be a row of numbers",
    ),
    "a Jacobian": (
        lambda: _native.hand_weights(np.zeros((5, 7)), 0.3),
        r"a Jacobian must be numbers of shape \(6, n\), but an array \(5, 7\)",
    ),
    "a Jacobian that is not finite": (
        lambda: _native.lost_speed(np.full((6, 7), np.nan), np.zeros(6), 0.3, 0.02),
        "finite numbers",
    ),
    "a posture": (
        lambda: LAW.setpoint(np.ones((6, 6)), np.zeros(6), np.zeros(6)),
        "the preferred angles of joints must be 6 numbers for this arm, but 7 were given",
    ),
    "limits of joints": (
        lambda: _native.JointLimits([np.ones(3)] * 4 + [np.ones(2)], 2, 0.008, 0.02),
        "the greatest jerks of joints must be 3 numbers for this arm, but 2 were given",
    ),
    "a state of joints": (
        lambda: LIMITS.window([np.zeros(2)] + [np.zeros(3)] * 3, np.zeros(2)),
        "the angles of joints must be 3 numbers for this arm, but 2 were given",
    ),
    "decelerations": (
        lambda: LIMITS.window([np.zeros(3)] * 4, np.zeros(4)),
        "there are 3 joints, but 4 were given",
    ),
    "a command": (
        lambda: LIMITS.braked(np.zeros(3), np.zeros(2), 0.0),
        "the commanded accelerations of joints must be 3 numbers",
    ),
    "speeds of joints": (
        lambda: BALLS.hold(np.zeros(6)),
        "the speeds of joints must be 7 numbers for this arm, but 6 were given",
    ),
    "bounds of numbers": (
        lambda: _native.is_between(np.zeros(3), np.zeros(2), np.zeros(3)),
        "each number needs a lower and an upper bound, but of 3 numbers 2 and 3 were given",
    ),
    "a deceleration for each room": (
        lambda: _native.stoppable_speed(np.ones(3), np.ones(2), 0.1),
        "a deceleration must be a number, or one for each room",
    ),
    "a goal": (lambda: ROOM.allowed([0.0, 1.0], np.zeros(3)), "a goal must be 3 numbers"),
    "a covariance": (
        lambda: _native.spread_at(np.zeros((3, 3)), np.zeros(3)),
        "a covariance of a pose must have 36 numbers for this motion, but it has 9",
    ),
    "the covariance of a twist": (
        lambda: _native.certain_twist((np.zeros(6), np.zeros(6), np.eye(3)), 0.1, (1.0, 1.0)),
        r"the covariance of a twist must be \(6, 6\), but has shape \[3, 3\]",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_arrays_that_do_not_fit_are_refused_in_words(name: str) -> None:
    compute, words = REFUSED[name]
    with pytest.raises(ServoError, match=words):
        compute()


def test_angles_that_are_not_finite_place_no_hand() -> None:
    with pytest.raises(PoseError, match="finite numbers, but it holds NaN"):
        CHAIN.world_from_hand(np.full(7, np.nan))


def test_whole_numbers_lists_and_slices_are_taken_as_arrays() -> None:
    rows = np.arange(84.0).reshape(6, 14)
    np.testing.assert_array_equal(
        _native.hand_weights(rows[:, ::2], 0.3), _native.hand_weights(rows[:, ::2].tolist(), 0.3)
    )
    np.testing.assert_array_equal(
        CHAIN.jacobian([1] * 7), CHAIN.jacobian(np.ones(14)[::2]), strict=True
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_certain_twist_keeps_its_direction_and_is_shortened_as_it_is_uncertain(seed: int) -> None:
    random = np.random.default_rng(seed)
    twist, change = random.normal(size=(2, 6))
    for deviation in (0.0, 0.5, 1.0, 4.0):
        spread = np.eye(6) * deviation**2 / 3
        found = _native.certain_twist((twist, change, spread), 0.1, (1.0, 2.0))
        shares = np.repeat([1 / max(1, deviation), 1 / max(1, deviation / 2)], 3)
        np.testing.assert_allclose(found, shares * (twist + 0.1 * change), atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_spread_of_a_point_is_that_of_small_motions_of_its_object(seed: int) -> None:
    random = np.random.default_rng(seed)
    root, lever = random.normal(size=(6, 6)), random.normal(size=3)
    moved = [column[:3] + np.cross(column[3:], lever) for column in root.T]
    expected = np.sqrt(np.square(moved).sum())
    assert _native.spread_at(root @ root.T, lever) == pytest.approx(expected)

"""Checks, before an arm moves, that its geometry agrees with itself and its hand is in its box."""

from collections.abc import Iterator

import numpy as np

from servoid.config import REACH_M
from servoid.errors import ServoError
from servoid.pose import Floats, Pose, exact
from servoid.servo.checked_arm import CheckedArm
from servoid.servo.settings import SafetySettings

_STEP_RAD = 1e-4  # by which a joint is varied on either side
_LINEAR, _ANGULAR = 0.02, 0.02  # m/rad and rad/rad, by which both may differ, and as a share
_OUTSIDE_M = 0.1  # of the box, from which on it is probably in another frame
_ANYWHERE_M = 1e3  # within which all parts are
_STILL = 1e-6  # m/rad and rad/rad, below which a pose does not depend on the joints
_SWAPPED = [3, 4, 5, 0, 1, 2]


def check_start(arm: CheckedArm, positions: Floats, settings: SafetySettings) -> None:
    """Check the Jacobian of an arm by its poses, and where its hand is; nothing is moved.

    `positions` (N,) are finite. An arm whose pose does not depend on the joint positions that are
    asked for cannot be checked.

    Raises:
        ServoError: they contradict each other, or the hand is far outside of its workspace.

    """
    hand = arm.world_from_hand(positions)
    _check_jacobian(arm, positions, hand)
    _check_solid(arm, positions)
    place = np.array(hand.translation)
    lower, upper = np.array(settings.workspace_lower), np.array(settings.workspace_upper)
    outside = exact.norm(np.maximum(0.0, np.maximum(lower - place, place - upper)))
    if outside > _OUTSIDE_M:
        raise ServoError(
            f"the hand is at {_numbers(place)} m in the world, {outside:.2f} m outside of the box "
            f"from {_numbers(lower)} to {_numbers(upper)}: give safety.workspace_lower and "
            "safety.workspace_upper in the world's frame, or move the hand inside first"
        )


def _check_jacobian(arm: CheckedArm, positions: Floats, hand: Pose) -> None:
    count = arm.joints.hand_count
    given = arm.jacobian(positions)[:, :count]
    moved = _differences(arm, positions, count, inverse=False)
    if not (exact.is_finite(given) and exact.is_finite(moved)):
        return
    if np.abs(moved).max() < _STILL:
        return
    reach = float(np.abs(moved[:3]).max())
    if reach > REACH_M:
        raise ServoError(
            f"Arm.world_from_hand moves the hand by {reach:.0f} m a radian: its poses, and the "
            "linear rows of Arm.jacobian, are in metres"
        )
    if _agree(given, moved):
        return
    cause = next((words for words, other in _slips(given, hand) if _agree(other, moved)), None)
    if cause is None and _agree(given, _differences(arm, positions, count, inverse=True)):
        cause = "world_from_hand returns hand_from_world, the inverse pose"
    if cause is None:
        off = np.abs(given - moved)
        row, column = np.unravel_index(int(off.argmax()), off.shape)
        way = f"{'angular' if row >= 3 else 'linear'} {'xyz'[row % 3]}"
        cause = (
            f"with {arm.joints.names[column]} the hand moves by {moved[row, column]:.3g} "
            f"({way}) a radian by world_from_hand, and by {given[row, column]:.3g} by jacobian"
        )
    raise ServoError(
        f"Arm.jacobian and Arm.world_from_hand contradict each other, so that the hand would run "
        f"away: {cause}; the Jacobian is (6, N), the hand's velocity in the world, first linear "
        "in m/rad, then angular, with a column for each joint"
    )


def _check_solid(arm: CheckedArm, positions: Floats) -> None:
    """Check that the distances of an arm's parts are in metres, by how fast they change."""
    if arm.solid is None:
        return
    slopes = np.abs(arm.solid.clearances(positions, _ANYWHERE_M).slopes)
    if slopes.size and exact.is_finite(slopes) and slopes.max() > REACH_M:
        raise ServoError(
            f"Arm.solid.clearances has slopes of up to {slopes.max():.0f} m a radian: distances of "
            "parts, and the slopes of these, are in metres; are they in millimetres?"
        )


def _slips(given: Floats, hand: Pose) -> Iterator[tuple[str, Floats]]:
    """Yield usual slips of a Jacobian, in words, and what it would be without each."""
    turn = hand.matrix()[:3, :3]
    turned = np.concatenate([exact.product(turn, rows) for rows in (given[:3], given[3:])])
    yield "the rows of jacobian are angular first, then linear", given[_SWAPPED]
    yield "jacobian is in the hand's frame, and not in the world's", turned
    yield "jacobian is in the hand's frame, and angular first", turned[_SWAPPED]
    yield "the columns of jacobian are in reversed order", given[:, ::-1]
    yield "jacobian has the opposite sign", -given
    yield "jacobian is in millimetres", np.concatenate([1e-3 * given[:3], given[3:]])
    yield "jacobian is per degree, and not per radian", np.degrees(given)


def _velocities(one: Pose, other: Pose) -> Floats:
    """Return the motion (6,) from one pose to another, linear and angular in the world."""
    turn = (other @ one.inverse()).log()[3:]
    return np.concatenate([np.subtract(other.translation, one.translation), turn])


def _differences(arm: CheckedArm, positions: Floats, count: int, *, inverse: bool) -> Floats:
    """Return the Jacobian (6, count) by differences of the hand's pose, or of its inverse."""
    columns = []
    for joint in range(count):
        step = np.zeros(len(positions))
        step[joint] = _STEP_RAD
        poses = [arm.world_from_hand(positions + way * step) for way in (-1.0, 1.0)]
        low, high = (pose.inverse() if inverse else pose for pose in poses)
        columns.append(_velocities(low, high) / (2.0 * _STEP_RAD))
    return np.stack(columns, axis=1)


def _agree(one: Floats, other: Floats) -> bool:
    """Return whether two Jacobians (6, n) are about the same."""
    for rows, allowed in ((slice(0, 3), _LINEAR), (slice(3, 6), _ANGULAR)):
        scale = max(1.0, float(np.abs(other[rows]).max()))
        if np.abs(one[rows] - other[rows]).max() > allowed * scale:
            return False
    return True


def _numbers(values: Floats) -> str:
    return f"({', '.join(f'{value:.3g}' for value in values)})"

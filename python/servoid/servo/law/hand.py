"""The hand's pose error, and by the paper's PD law the velocity that reduces it."""

import numpy as np

from servoid.pose import Floats, exact
from servoid.servo.law.moving import Moving
from servoid.servo.settings import HandSettings


def quaternion_error(hand_from_goal: Moving) -> Floats:
    """Return the vector part (3,) of the shorter unit quaternion of the rotation to the goal."""
    w, *vector = hand_from_goal.pose.quaternion
    return np.copysign(1.0, w) * np.asarray(vector)


def correction(hand_from_goal: Moving, world_from_hand: Floats, settings: HandSettings) -> Floats:
    """Return the hand's desired velocity (6,), linear and angular in the world.

    `world_from_hand` is (4, 4); only its rotation is used.
    """
    turn = world_from_hand[:3, :3]
    offset = exact.product(turn, hand_from_goal.matrix[:3, 3])
    off = exact.product(turn, quaternion_error(hand_from_goal))
    rates = hand_from_goal.twist
    moving, turning = exact.product(turn, rates[:3]), exact.product(turn, rates[3:])
    linear = settings.position_gain * offset + settings.position_rate_gain * moving  # Eq. (12)
    angular = settings.turn_gain * off + settings.turn_rate_gain * turning  # Eq. (13)
    return np.concatenate([linear, angular])


def shares(twist: Floats, linear: float, angular: float) -> Floats:
    """Return factors (2,), at most 1, that limit a twist's two parts to the given lengths."""
    lengths = np.sqrt(np.square(twist).reshape(2, 3).sum(axis=1))
    return np.minimum(1.0, (linear, angular) / np.maximum(lengths, 1e-12))


def within(twist: Floats, linear: float, angular: float) -> Floats:
    """Return a twist (6,) whose linear and angular parts have at most the given lengths."""
    return twist * np.repeat(shares(twist, linear, angular), 3)


def goal_error(
    world_from_hand: Moving, world_from_object: Moving, goal_from_object: Moving
) -> Moving:
    """Return `hand_from_goal`, the pose error of the hand, with its derivatives.

    `world_from_object` is the true or estimated pose of the object, and `goal_from_object` its
    desired pose in the hand. All three may move.
    """
    hand_from_object = world_from_hand.inverse() @ world_from_object
    object_from_goal = goal_from_object.inverse()
    # The paper writes the product rule explicitly; `Moving` applies it.
    return hand_from_object @ object_from_goal  # Eqs. (8)-(11)

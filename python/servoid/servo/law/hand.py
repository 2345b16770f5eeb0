"""The hand's velocity from its pose error, by the paper's PD law."""

import numpy as np

from servoid.pose import exact
from servoid.servo.arm import Floats
from servoid.servo.law.moving import Moving
from servoid.servo.settings import HandSettings


def quaternion_error(hand_from_goal: Moving) -> Floats:
    """Return (3,): the vector part of the turn to the goal as a unit quaternion, the short way."""
    w, *vector = hand_from_goal.pose.quaternion
    return np.copysign(1.0, w) * np.asarray(vector)


def correction(hand_from_goal: Moving, world_from_hand: Floats, settings: HandSettings) -> Floats:
    """Return (6,) the hand's desired velocity, linear and angular in the world.

    `world_from_hand` is (4, 4); only its turn is used.
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
    """Return (2,): shares of a twist's two parts that are no longer than these, 1 where all is."""
    lengths = np.sqrt(np.square(twist).reshape(2, 3).sum(axis=1))
    return np.minimum(1.0, (linear, angular) / np.maximum(lengths, 1e-12))


def within(twist: Floats, linear: float, angular: float) -> Floats:
    """Return a twist (6,) whose linear and angular parts are no longer than these."""
    return twist * np.repeat(shares(twist, linear, angular), 3)

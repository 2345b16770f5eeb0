"""The hand's pose error, and by the paper's PD law the velocity that reduces it."""

from servoid._native import Moving, hand_correction
from servoid.pose import Floats, Pose
from servoid.servo.settings import HandSettings


def correction(hand_from_goal: Moving, world_from_hand: Pose, settings: HandSettings) -> Floats:
    """Return the hand's desired velocity (6,), linear and angular in the world.

    Of `world_from_hand` only the rotation is used.
    """
    gains = (
        settings.position_gain,
        settings.position_rate_gain,
        settings.turn_gain,
        settings.turn_rate_gain,
    )
    return hand_correction(hand_from_goal, world_from_hand, gains)


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

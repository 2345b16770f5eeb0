"""The desired trajectory: the pose error of the hand and its derivatives."""

from servoid.servo.law.moving import Moving


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

"""The desired trajectory: how far the hand is from where it should be, and how that changes."""

from servoid.servo.law.moving import Moving


def goal_error(
    world_from_hand: Moving, world_from_object: Moving, goal_from_object: Moving
) -> Moving:
    """Return `hand_from_goal`, the pose error of the hand, with its derivatives.

    `world_from_object` is where the object is or is believed to be, and `goal_from_object` where
    it should be as seen from the hand. All three may move.
    """
    hand_from_object = world_from_hand.inverse() @ world_from_object
    object_from_goal = goal_from_object.inverse()
    # The paper writes the product rule out; `Moving` carries it.
    return hand_from_object @ object_from_goal  # Eqs. (8)-(11)

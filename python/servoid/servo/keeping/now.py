"""The arm in one control period, and the command before it."""

from dataclasses import dataclass

import numpy as np

from servoid.pose import Floats, Pose
from servoid.servo.arm import JointState
from servoid.servo.keeping.bounds import Window


@dataclass(frozen=True, eq=False)
class Now:
    """The arm in this control period.

    `jacobian` (6, n) and `twist` (6,) are the hand's, in the world.
    `previous` (N,) are the last commanded joint speeds, `acceleration` (N,) their rate of change,
    `last` (6,) the corresponding hand velocity, and `window` the speeds that may follow.
    """

    state: JointState
    world_from_hand: Pose
    jacobian: Floats
    twist: Floats
    previous: Floats
    acceleration: Floats
    last: Floats
    window: Window

    @property
    def place(self) -> Floats:
        """Return the position of the hand in the world, (3,)."""
        return np.array(self.world_from_hand.translation)


@dataclass(frozen=True, eq=False)
class LastCommand:
    """The last command: speeds (N,) of all joints, and the corresponding hand velocity (6,).

    `acceleration` (N,) is the rate of change of the speeds.
    """

    time_s: float
    velocities: Floats
    acceleration: Floats
    twist: Floats
    jacobian: Floats

"""Turns that images do not tell, such as the spin of a plain bottle: they are left as they were."""

from dataclasses import dataclass

import numpy as np

from servoid.pose import Pose
from servoid.servo.arm import Floats
from servoid.servo.moving import change_between, shifted_and_turned

_MOSTLY_TURN = 0.7  # share of a unit motion from which on it counts as a turn
_PASSES = 20  # turns about different axes do not quite commute
_ENOUGH = 1e-6  # rad: a pass that turns less is the last


@dataclass(frozen=True, eq=False)
class OpenTurns:
    """Orthonormal axes in the world, (3, k), about which an object's turn is not told.

    `told` (3, 3 - k) are the axes across them.
    """

    axes: Floats
    told: Floats

    @classmethod
    def of(cls, unobservable: Floats, world_from_object: Pose) -> "OpenTurns":
        """Take the turns among motions (n, 6) in the object's frame that images leave open."""
        turns = unobservable[:, 3:]
        turns = turns[np.linalg.norm(turns, axis=1) > _MOSTLY_TURN]
        if len(turns) == 0:
            return cls(np.empty((3, 0)), np.eye(3))
        axes = world_from_object.matrix()[:3, :3] @ turns.T
        basis, _ = np.linalg.qr(axes, mode="complete")
        count = min(len(turns), 3)
        return cls(basis[:, :count], basis[:, count:])

    def left_out(self, expected: Pose, seen: Pose) -> Pose:
        """Return the seen pose, turned about the open axes as the expected one is."""
        if self.axes.shape[1] == 0:
            return seen
        for _ in range(_PASSES):
            turn = change_between(expected, seen)[3:]
            back = -self.axes @ (self.axes.T @ turn)
            seen = shifted_and_turned(seen, np.concatenate([np.zeros(3), back]))
            if np.abs(back).max() < _ENOUGH:
                break
        return seen

"""Turns that images do not observe, such as the spin of a bottle: they stay as they were."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.pose import Pose, exact
from servoid.servo.arm import Floats
from servoid.servo.law.moving import change_between, shifted_and_turned

_MOSTLY_TURN = 0.7  # share of a unit motion from which on it counts as a turn
_APART = 0.5  # singular value of unit axes from which on they span one direction more
_PASSES = 20  # turns about different axes do not quite commute
_ENOUGH = 1e-6  # rad: a pass that turns less is the last


class UnsureEstimate(Protocol):
    """Where an object was, and how sure that is.

    `covariance` (6, 6) is of a small motion (linear, angular) of the object in its own frame.
    """

    @property
    def world_from_object(self) -> Pose:
        """Return where the object was."""
        ...

    @property
    def covariance(self) -> Floats:
        """Return how sure that is, (6, 6)."""
        ...

    @property
    def unobservable(self) -> Floats:
        """Return (n, 6) unit motions in the object's frame that the images leave open."""
        ...


@dataclass(frozen=True, eq=False)
class UnobservableTurns:
    """Orthonormal axes in the world, (3, k), about which an object's turn is not observable.

    `observable` (3, 3 - k) are the axes across them.
    """

    axes: Floats
    observable: Floats

    @property
    def spread(self) -> Floats:
        """Return the (3, 3) matrix that leaves of a vector what lies along the open axes."""
        return exact.product(self.axes, self.axes.T) if self.axes.size else np.zeros((3, 3))

    @classmethod
    def of(cls, estimate: UnsureEstimate) -> "UnobservableTurns":
        """Take the turns that the images leave open."""
        turns = estimate.unobservable[:, 3:]
        turns = turns[exact.lengths(turns) > _MOSTLY_TURN]
        if len(turns) == 0:
            return cls(np.empty((3, 0)), np.eye(3))
        # Both may name the same axis, so directions that are nearly alike count once.
        spread = exact.product(estimate.world_from_object.matrix()[:3, :3], turns.T)
        squares, axes = exact.eigh(exact.product(spread, spread.T))
        apart = squares > _APART * _APART
        return cls(axes[:, apart], axes[:, ~apart])

    def left_out(self, expected: Pose, seen: Pose) -> Pose:
        """Return the seen pose, turned about the open axes as the expected one is."""
        if self.axes.shape[1] == 0:
            return seen
        for _ in range(_PASSES):
            turn = change_between(expected, seen)[3:]
            back = -exact.product(self.axes, exact.product(self.axes.T, turn))
            seen = shifted_and_turned(seen, np.concatenate([np.zeros(3), back]))
            if np.abs(back).max() < _ENOUGH:
                break
        return seen

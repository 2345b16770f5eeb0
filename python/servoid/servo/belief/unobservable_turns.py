"""Rotations that images do not observe, such as a bottle about its axis: they are kept."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid._native import change_between, shifted_and_turned
from servoid.pose import Floats, Pose, exact
from servoid.track import unobservable_axes

_PASSES = 20  # passes, as rotations about different axes do not commute
_ENOUGH = 1e-6  # rad: a pass that rotates less is the last
_MOSTLY_SHIFT = 0.7  # share of translation in a motion from which on it counts as one


class UnsureEstimate(Protocol):
    """A pose of an object with its uncertainty.

    `covariance` (6, 6) is of a small motion (linear, angular) of the object in its own frame.
    """

    @property
    def world_from_object(self) -> Pose:
        """Return the pose of the object."""
        ...

    @property
    def covariance(self) -> Floats:
        """Return the covariance, (6, 6)."""
        ...

    @property
    def unobservable(self) -> Floats:
        """Return (n, 6) unit motions in the object's frame that the images do not observe."""
        ...


@dataclass(frozen=True, eq=False)
class UnobservableTurns:
    """Orthonormal axes in the world, (3, k), about which an object's rotation is unobservable.

    `observable` (3, 3 - k) are the axes orthogonal to them.
    """

    axes: Floats
    observable: Floats

    @property
    def spread(self) -> Floats:
        """Return the projection (3, 3) onto the unobservable axes."""
        return exact.product(self.axes, self.axes.T) if self.axes.size else np.zeros((3, 3))

    @classmethod
    def of(cls, estimate: UnsureEstimate) -> "UnobservableTurns":
        """Compute the unobservable rotations of an estimate."""
        rotation = estimate.world_from_object.matrix()[:3, :3]
        return cls(*unobservable_axes(estimate.unobservable, rotation))

    def with_expected(self, expected: Pose, seen: Pose) -> Pose:
        """Return the estimated pose, with the expected rotation about the unobservable axes."""
        if self.axes.shape[1] == 0:
            return seen
        for _ in range(_PASSES):
            turn = change_between(expected, seen)[3:]
            back = -exact.product(self.axes, exact.product(self.axes.T, turn))
            seen = shifted_and_turned(seen, np.concatenate([np.zeros(3), back]))
            if np.abs(back).max() < _ENOUGH:
                break
        return seen


def unobservable_shifts(unobservable: Floats) -> int:
    """Return how many of the motions (n, 6) that images do not observe mostly translate."""
    shifts = exact.lengths(unobservable[:, :3])
    return int(np.count_nonzero(shifts > _MOSTLY_SHIFT * exact.lengths(unobservable)))

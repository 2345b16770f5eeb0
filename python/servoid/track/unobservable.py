"""Separates the rotations of an object that images observe from those that they do not."""

import numpy as np

from servoid.pose import Floats, exact

_MOSTLY_TURN = 0.7  # share of rotation in a unit motion from which on it counts as a rotation
_APART = 0.5  # singular value from which on unit axes span another direction


def unobservable_axes(unobservable: Floats, rotation: Floats) -> tuple[Floats, Floats]:
    """Return orthonormal axes about which rotations are unobservable, and those across.

    They are the columns of (3, k) and (3, 3 - k) float64. Of the unit motions `unobservable` (n, 6)
    those count that mostly rotate; `rotation` (3, 3) turns them into the frame of the axes.
    """
    turns = unobservable[:, 3:]
    turns = turns[exact.lengths(turns) > _MOSTLY_TURN]
    if len(turns) == 0:
        return np.empty((3, 0)), np.eye(3)
    # Several motions may have the same axis, so nearly equal directions count once.
    spread = exact.product(rotation, turns.T)
    squares, axes = exact.eigh(exact.product(spread, spread.T))
    apart = squares > _APART * _APART
    return axes[:, apart], axes[:, ~apart]

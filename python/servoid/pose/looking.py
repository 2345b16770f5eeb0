"""Poses of what looks at a point."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.errors import PoseError
from servoid.pose import exact


def looking(
    place: Sequence[float] | NDArray[np.float64], aim: Sequence[float] | NDArray[np.float64]
) -> Pose:
    """Return where a camera or hand stands that looks from one point (3,) of the world to another.

    It looks along its z, its x is level and its y points down, as z of the world is up.

    Raises:
        PoseError: the points are one, or one is straight above the other.

    """
    here = np.asarray(place, dtype=np.float64)
    forward = np.asarray(aim, dtype=np.float64) - here
    right = np.cross(forward, [0.0, 0.0, 1.0])
    lengths = exact.norm(forward), exact.norm(right)
    if not min(lengths) > 0.0:
        raise PoseError(
            f"to look from {here.tolist()} to {np.asarray(aim).tolist()} can be done in any turn; "
            "choose points that are not above each other"
        )
    forward, right = forward / lengths[0], right / lengths[1]
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(forward, right), forward, here])
    return Pose(matrix)

"""Computes poses that look at a point, and converts the frames of cameras that look otherwise."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.errors import PoseError
from servoid.pose import exact

CV_FROM_GL = Pose.from_parts((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
"""From the camera frame of OpenGL and Blender, y up and z backwards, to ours, y down, z forward."""


def looking(
    place: Sequence[float] | NDArray[np.float64], aim: Sequence[float] | NDArray[np.float64]
) -> Pose:
    """Return the pose of a camera or hand that looks from one point (3,) of the world at another.

    It looks along its z axis. Its x axis is horizontal and its y axis points down; the world's z
    axis points up.

    Raises:
        PoseError: the points coincide, or one is vertically above the other.

    """
    here = np.asarray(place, dtype=np.float64)
    forward = np.asarray(aim, dtype=np.float64) - here
    right = np.cross(forward, [0.0, 0.0, 1.0])
    lengths = exact.norm(forward), exact.norm(right)
    if not min(lengths) > 0.0:
        raise PoseError(
            f"to look from {here.tolist()} to {np.asarray(aim).tolist()} leaves the rotation about "
            "the line of sight open; choose points that are not above each other"
        )
    forward, right = forward / lengths[0], right / lengths[1]
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(forward, right), forward, here])
    return Pose(matrix)

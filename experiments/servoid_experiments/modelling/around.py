"""Cameras around an object at the origin: x right, y down, z away."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.pose.exact import Floats

_UP = np.array([0.0, -1.0, 0.0])
GOLDEN = float(np.pi * (3.0 - np.sqrt(5.0)))  # spreads any number of views evenly


def around(
    count: int,
    begin: float,
    elevations_deg: Sequence[float],
    away: float,
    *,
    step: float = GOLDEN,
) -> list[Pose]:
    """Return `object_from_camera` of cameras on all sides of the object, at alternating heights.

    `begin` in radians is the angle of the first one. Each next one is `step` radians further: by
    default 137.5 degrees, so that even two see different outlines. All look at the origin from
    `away` metres.
    """
    poses = []
    for index in range(count):
        azimuth = begin + step * index
        rise = np.radians(elevations_deg[index % len(elevations_deg)])
        level = np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
        poses.append(watching(away * (np.cos(rise) * level + np.sin(rise) * _UP)))
    return poses


def watching(place: NDArray[np.float64]) -> Pose:
    """Return `object_from_camera` of a level camera at a position (3,) that looks at the origin."""
    forward: Floats = -place / np.linalg.norm(place)
    right = np.cross(forward, _UP)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(forward, right), forward
    matrix[:3, 3] = place
    return Pose(matrix)

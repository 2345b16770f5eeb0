"""Solids with a signed distance, negative inside, which never exceeds the true distance."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
Triple = tuple[float, float, float]


class Solid(Protocol):
    """A solid with a signed distance function."""

    def distance(self, points: Array) -> Array:
        """Return the signed distances of points (3, N) in metres, as (N,)."""
        ...


@dataclass(frozen=True)
class RoundCone:
    """The hull of two spheres: a ball, a capsule or a drop, depending on the radii."""

    start: Triple
    end: Triple
    start_radius: float
    end_radius: float

    def distance(self, points: Array) -> Array:
        """Return the exact signed distances of points (3, N), as (N,)."""
        start = np.asarray(self.start)
        axis = np.asarray(self.end) - start
        length = float(np.linalg.norm(axis))
        axis /= length
        # The slope of normals towards the thinner end.
        lean = (self.start_radius - self.end_radius) / length
        slope = np.float32(lean / np.sqrt(1.0 - lean * lean))
        x, y, z = (points[i] - np.float32(start[i]) for i in range(3))
        along = x * np.float32(axis[0])
        along += y * np.float32(axis[1])
        along += z * np.float32(axis[2])
        x *= x
        x += y * y
        x += z * z
        x -= along * along
        across = np.sqrt(np.maximum(x, np.float32(0), out=x), out=x)
        nearest = np.clip(along - slope * across, np.float32(0), np.float32(length))
        along -= nearest
        radius = np.float32(self.start_radius) - np.float32(lean) * nearest
        return np.sqrt(along * along + across * across) - radius


@dataclass(frozen=True)
class RoundBox:
    """A box with rounded edges; the rows of `axes` are its three directions."""

    center: Triple
    half_size: Triple
    rounding: float
    axes: NDArray[np.float64]

    def distance(self, points: Array) -> Array:
        """Return the exact signed distances of points (3, N), as (N,)."""
        axes = self.axes.astype(np.float32)
        center = (self.axes @ np.asarray(self.center)).astype(np.float32)
        core = np.asarray(self.half_size, np.float32) - np.float32(self.rounding)
        beyond = np.abs(axes @ points - center[:, None]) - core[:, None]
        inside = np.minimum(np.maximum(np.maximum(beyond[0], beyond[1]), beyond[2]), np.float32(0))
        np.maximum(beyond, np.float32(0), out=beyond)
        beyond *= beyond
        return np.sqrt(beyond[0] + beyond[1] + beyond[2]) + inside - np.float32(self.rounding)


@dataclass(frozen=True)
class RoundCylinder:
    """A vertical cylinder with rounded rims."""

    center: Triple
    radius: float
    half_height: float
    rounding: float

    def distance(self, points: Array) -> Array:
        """Return the exact signed distances of points (3, N), as (N,)."""
        x, y, z = (points[i] - np.float32(self.center[i]) for i in range(3))
        aside = np.sqrt(x * x + y * y) - np.float32(self.radius - self.rounding)
        above = np.abs(z) - np.float32(self.half_height - self.rounding)
        inside = np.minimum(np.maximum(aside, above), np.float32(0))
        np.maximum(aside, np.float32(0), out=aside)
        np.maximum(above, np.float32(0), out=above)
        return np.sqrt(aside * aside + above * above) + inside - np.float32(self.rounding)


def blend(first: Array, second: Array, width: float) -> Array:
    """Return the smooth union of two distances, rounded over `width` metres."""
    overlap = np.maximum(np.float32(width) - np.abs(first - second), np.float32(0))
    return np.minimum(first, second) - overlap * overlap * np.float32(0.25 / width)


def turned_axes(yaw_deg: float, pitch_deg: float, roll_deg: float) -> NDArray[np.float64]:
    """Return the directions, as rows, of a box after roll, pitch and yaw."""
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    turn = [[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    rise = [
        [np.cos(pitch), 0.0, -np.sin(pitch)],
        [0.0, 1.0, 0.0],
        [np.sin(pitch), 0.0, np.cos(pitch)],
    ]
    lean = [[1.0, 0.0, 0.0], [0.0, np.cos(roll), -np.sin(roll)], [0.0, np.sin(roll), np.cos(roll)]]
    return (np.array(turn) @ rise @ lean).T

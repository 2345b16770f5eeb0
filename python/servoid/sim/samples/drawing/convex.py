"""Convex solids that rays meet without any marching: ellipsoids, boxes and tubes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.sim.samples.drawing.solids import Triple, turned_axes

Floats = NDArray[np.float64]

_ENDLESS = float("inf")
_LIFT = 1e-4  # metres that a solid must reach off a point to shade it


@dataclass(frozen=True, eq=False)
class Convex:
    """The common part of quadrics |point / radii| <= 1, each endless where a radius is inf.

    `center` (3,) and `axes` (3, 3), as rows, place the solid in a thing's frame; `radii` (K, 3)
    are along the axes.
    """

    center: Floats
    axes: Floats
    radii: Floats

    @property
    def bound(self) -> float:
        """Return the radius of a ball around the centre that holds the solid."""
        least = self.radii.min(axis=0)
        together = float(np.sqrt((least * least).sum()))
        return float(least.max()) if len(self.radii) == 1 else together

    def to_local(self, points: Floats) -> Floats:
        """Take points (3, N) of the thing's frame into the solid's own axes."""
        return self.axes @ (points - self.center[:, None])

    def holds(self, points: Floats) -> NDArray[np.bool_]:
        """Say which points (3, N) of the thing's frame are inside."""
        return np.asarray(self._levels(self.to_local(points)).max(axis=0) < 1.0)

    def normals(self, local: Floats) -> Floats:
        """Return unit normals (3, N) in the thing's frame of surface points in own axes."""
        active = self._levels(local).argmax(axis=0)
        slopes = (1.0 / self.radii**2)[active].T * local
        slopes /= np.sqrt((slopes * slopes).sum(axis=0))
        return self.axes.T @ slopes

    def surface(self, ways: Floats) -> Floats:
        """Return the points (3, N), in the thing's frame, on the surface along own ways (3, N)."""
        reach = 1.0 / np.sqrt(self._levels(ways).max(axis=0))
        return self.center[:, None] + self.axes.T @ (reach * ways)

    def crossing(self, frame_from_camera: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the depths (rows, columns) at which a camera's rays enter and leave.

        The ray of column i and row j leaves the camera, whose pose is (4, 4), towards
        (x[i], y[j], 1) in its own frame. A ray that misses leaves before it enters.
        """
        start = self.axes @ (frame_from_camera[:3, 3] - self.center)
        turn = self.axes @ frame_from_camera[:3, :3]
        row = y[:, None]
        spans = []
        for weights in 1.0 / self.radii**2:
            m = turn.T @ (weights[:, None] * turn)
            by_row = (m[1, 1] * row + 2.0 * m[1, 2]) * row + m[2, 2]
            a = (m[0, 0] * x + 2.0 * m[0, 1] * row + 2.0 * m[0, 2]) * x + by_row
            slope = turn.T @ (weights * start)
            b = slope[0] * x + (slope[1] * row + slope[2])
            spans.append(_roots(a, b, float(weights @ (start * start)) - 1.0))
        return _common(spans)

    def shades(self, points: Floats, light: Floats) -> NDArray[np.bool_]:
        """Say from which points (3, N) of the thing's frame the solid hides a far light (3,)."""
        local, way = self.to_local(points), self.axes @ light
        spans = []
        for weights in 1.0 / self.radii**2:
            a = np.asarray(weights @ (way * way))
            spans.append(_roots(a, (weights * way) @ local, weights @ (local * local) - 1.0))
        enter, leave = _common(spans)
        return np.asarray(leave > np.maximum(enter, 0.0) + _LIFT)

    def _levels(self, local: Floats) -> Floats:
        return (1.0 / self.radii**2) @ (local * local)


def _roots(a: Floats, b: Floats, c: Floats | float) -> tuple[Floats, Floats]:
    """Return both roots of a t² + 2 b t + c; those that do not exist are in the wrong order."""
    a = np.maximum(a, 1e-12)  # along an endless quadric
    inner = b * b - a * c
    half = np.sqrt(np.maximum(inner, 0.0))
    half[inner < 0.0] = -np.inf
    return (-b - half) / a, (-b + half) / a


def _common(spans: list[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    enter, leave = spans[0]
    for more in spans[1:]:
        enter, leave = np.maximum(enter, more[0]), np.minimum(leave, more[1])
    return enter, leave


def ellipsoid(center: Triple, radii: Triple, angles_deg: Triple = (0.0, 0.0, 0.0)) -> Convex:
    """Return an ellipsoid, turned by (yaw, pitch, roll)."""
    return Convex(np.array(center), turned_axes(*angles_deg), np.array([radii]))


def box(center: Triple, half_size: Triple, angles_deg: Triple = (0.0, 0.0, 0.0)) -> Convex:
    """Return a box, turned by (yaw, pitch, roll)."""
    radii = np.full((3, 3), _ENDLESS)
    np.fill_diagonal(radii, half_size)
    return Convex(np.array(center), turned_axes(*angles_deg), radii)


def tube(
    center: Triple, radius: float, half_height: float, angles_deg: Triple = (0.0, 0.0, 0.0)
) -> Convex:
    """Return a closed cylinder along its own z, turned by (yaw, pitch, roll)."""
    radii = np.array([[radius, radius, _ENDLESS], [_ENDLESS, _ENDLESS, half_height]])
    return Convex(np.array(center), turned_axes(*angles_deg), radii)

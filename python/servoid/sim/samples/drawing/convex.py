"""Convex solids: ellipsoids, boxes and tubes, with points on their surfaces."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.sim.samples.drawing.solids import Triple, turned_axes

_ENDLESS = float("inf")


@dataclass(frozen=True, eq=False)
class Convex:
    """The intersection of quadrics |point / radii| <= 1, unbounded along axes with radius inf.

    `center` (3,) and `axes` (3, 3), as rows, give the pose of the solid in the frame of its object;
    `radii` (K, 3) are along the axes.
    """

    center: Floats
    axes: Floats
    radii: Floats

    @property
    def bound(self) -> float:
        """Return the radius of a ball around the centre that contains the solid."""
        least = self.radii.min(axis=0)
        together = float(np.sqrt((least * least).sum()))
        return float(least.max()) if len(self.radii) == 1 else together

    def to_local(self, points: Floats) -> Floats:
        """Transform points (3, N) from the object's frame to the solid's own axes."""
        return self.axes @ (points - self.center[:, None])

    def holds(self, points: Floats) -> NDArray[np.bool_]:
        """Return which points (3, N) of the object's frame are inside."""
        return np.asarray(self._levels(self.to_local(points)).max(axis=0) < 1.0)

    def surface(self, ways: Floats) -> Floats:
        """Return surface points (3, N), in the object's frame, along the solid's directions."""
        reach = 1.0 / np.sqrt(self._levels(ways).max(axis=0))
        return self.center[:, None] + self.axes.T @ (reach * ways)

    def _levels(self, local: Floats) -> Floats:
        return (1.0 / self.radii**2) @ (local * local)


def ellipsoid(center: Triple, radii: Triple, angles_deg: Triple = (0.0, 0.0, 0.0)) -> Convex:
    """Return an ellipsoid, rotated by (yaw, pitch, roll)."""
    return Convex(np.array(center), turned_axes(*angles_deg), np.array([radii]))


def box(center: Triple, half_size: Triple, angles_deg: Triple = (0.0, 0.0, 0.0)) -> Convex:
    """Return a box, rotated by (yaw, pitch, roll)."""
    radii = np.full((3, 3), _ENDLESS)
    np.fill_diagonal(radii, half_size)
    return Convex(np.array(center), turned_axes(*angles_deg), radii)


def tube(
    center: Triple, radius: float, half_height: float, angles_deg: Triple = (0.0, 0.0, 0.0)
) -> Convex:
    """Return a closed cylinder along its own z, rotated by (yaw, pitch, roll)."""
    radii = np.array([[radius, radius, _ENDLESS], [_ENDLESS, _ENDLESS, half_height]])
    return Convex(np.array(center), turned_axes(*angles_deg), radii)

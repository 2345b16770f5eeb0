"""Samples the surface of a body, and computes which of it a camera sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body
from servoid.pose import Floats, Pose, exact

_FACING = 0.35  # minimum cosine between normal and direction to a camera for a good view
_PLACES = 400  # samples of the whole surface
_LEAST_WAYS = 30  # minimum number of sampled directions per ellipsoid
_AWAY = 0.02  # radii from a sample within which its own surface does not occlude it


@dataclass(frozen=True, eq=False)
class _Solid:
    """An ellipsoid in the world: centre (3,), radii (3,) and its axes as columns (3, 3)."""

    center: Floats
    radii: Floats
    axes: Floats

    def within(self, points: Floats) -> Floats:
        """Return points (N, 3) in the frame in which the ellipsoid is the unit ball."""
        return exact.product(points - self.center, self.axes) / self.radii


class Surface:
    """Samples of a body's surface, each of which represents about the same area."""

    def __init__(self, body: Body) -> None:
        self._solids = _solids(body)
        ways = _even_ways(max(_LEAST_WAYS, 2 * _PLACES // len(body)))
        places, normals, areas = [], [], []
        for solid in self._solids:
            outward = ways / solid.radii
            length = exact.lengths(outward)
            place = exact.product(ways * solid.radii, solid.axes.T) + solid.center
            others = [other for other in self._solids if other is not solid]
            outside = [np.square(other.within(place)).sum(axis=1) >= 1.0 for other in others]
            keep = np.logical_and.reduce([np.ones(len(ways), np.bool_), *outside])
            places.append(place[keep])
            normals.append(exact.product(outward / length[:, None], solid.axes.T)[keep])
            areas.append((np.prod(solid.radii) * length)[keep])
        area = np.concatenate(areas).cumsum()
        chosen = np.searchsorted(area, (np.arange(_PLACES) + 0.5) / _PLACES * area[-1])
        self.places: Floats = np.concatenate(places)[chosen]
        self.normals: Floats = np.concatenate(normals)[chosen]

    def __len__(self) -> int:
        return len(self.places)

    def seen_from(self, eye: Floats) -> NDArray[np.bool_]:
        """Return which samples a camera at a point (3,) of the world sees well, (N,) bool."""
        ways = eye - self.places
        ways /= exact.lengths(ways)[:, None]
        seen = (ways * self.normals).sum(axis=1) > _FACING
        for solid in self._solids:
            start = solid.within(self.places)
            way = exact.product(ways, solid.axes) / solid.radii
            a, b = (way * way).sum(axis=1), (start * way).sum(axis=1)
            c = (start * start).sum(axis=1) - 1.0
            square = b * b - a * c
            far = (np.sqrt(np.maximum(square, 0.0)) - b) / a
            seen &= ~((square > 0.0) & (far > _AWAY * solid.radii.max()) & (c > 0.0))
        return seen


def body_places(body: Body) -> Floats:
    """Return samples (N, 3) of a body's surface, in its own frame, of equal areas."""
    return body.world_from_object.inverse().transform(Surface(body).places)


def _solids(body: Body) -> list[_Solid]:
    solids = []
    for center, radii, turn in zip(body.centers, body.radii, body.rotations, strict=True):
        pose = body.world_from_object @ Pose.from_parts(center.tolist(), turn.tolist())
        solids.append(_Solid(np.array(pose.translation), radii, pose.matrix()[:3, :3]))
    return solids


def _even_ways(count: int) -> Floats:
    """Return unit vectors (N, 3), evenly distributed on a spiral."""
    height = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    around = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - height * height)
    return np.stack([flat * exact.cos(around), flat * exact.sin(around), height], axis=1)

"""Closed surfaces over cross-sections along an axis: surfaces of revolution, and lofts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from servoid.pose import Floats, exact
from servoid.sim.world.scene.visuals import MeshShape

_AROUND = 64
_FINE = 32  # measured steps for each step around


@dataclass(frozen=True)
class Section:
    """A cross-section: its centre, and its half sizes perpendicular to the axis.

    `corner` is the exponent of a superellipse: 2 is an ellipse, more approaches a rectangle.
    """

    center: tuple[float, float, float]
    half_size: tuple[float, float]
    corner: float = 2.0


def lathe(profile: Sequence[tuple[float, float]], around: int = _AROUND) -> MeshShape:
    """Revolve a profile of (radius, height) about z, and close both ends flat.

    Texture: u goes once around, to the right as seen from outside with z up; v is the arc length
    from 0 at the profile's end to 1 at its beginning.
    """
    sections = [Section((0.0, 0.0, height), (radius, radius)) for radius, height in profile]
    return top_first(loft(sections, around=around))


def top_first(mesh: MeshShape) -> MeshShape:
    """Return a mesh with v reversed, so that a print is upright."""
    if mesh.texture_coordinates is None:
        return mesh
    return replace(mesh, texture_coordinates=mesh.texture_coordinates * [1.0, -1.0] + [0.0, 1.0])


def loft(
    sections: Sequence[Section], axes: Floats | None = None, around: int = _AROUND
) -> MeshShape:
    """Join cross-sections to a closed surface with flat ends.

    The rows of `axes` (3, 3) are the two directions across and the direction along. Texture: u goes
    once around from the first direction to the second, v along, both by arc length.
    """
    across_u, across_v, _ = np.eye(3) if axes is None else axes
    rings = [_ring(section, around, across_u, across_v) for section in sections]
    rings = [_cap(rings[0]), *rings, _cap(rings[-1])]
    points = np.array(rings)
    ways = exact.lengths(np.diff(points, axis=0)).mean(axis=1)
    gone = np.concatenate([[0.0], np.cumsum(ways)])
    v = np.repeat(gone / gone[-1], around + 1)
    u = np.tile(np.linspace(0.0, 1.0, around + 1), len(rings))
    vertices = points.reshape(-1, 3)
    return MeshShape(vertices, _faces(len(rings), around), np.stack([u, v], axis=1))


def tube(centers: Floats, radius: float, around: int = 24) -> MeshShape:
    """Return a closed round tube along a polyline (N, 3) in the x-z plane."""
    along = np.gradient(centers, axis=0)
    along /= exact.lengths(along)[:, None]
    aside = np.cross([0.0, 1.0, 0.0], along)
    angles = np.linspace(0.0, 2.0 * np.pi, around + 1)[None, :, None]
    rings = centers[:, None] + radius * (
        exact.cos(angles) * aside[:, None] + exact.sin(angles) * np.array([0.0, 1.0, 0.0])
    )
    points = np.concatenate([_cap(rings[0])[None], rings, _cap(rings[-1])[None]])
    v = np.repeat(np.linspace(0.0, 1.0, len(points)), around + 1)
    u = np.tile(np.linspace(0.0, 1.0, around + 1), len(points))
    vertices = points.reshape(-1, 3)
    return MeshShape(vertices, _faces(len(points), around), np.stack([u, v], axis=1))


def _ring(section: Section, around: int, across_u: Floats, across_v: Floats) -> Floats:
    """Return points (around + 1, 3) evenly around a cross-section, the first one twice."""
    power = 2.0 / section.corner
    angles = np.linspace(0.0, 2.0 * np.pi, _FINE * around + 1)
    cosine, sine = exact.cos(angles), exact.sin(angles)
    first = section.half_size[0] * np.sign(cosine) * _powers(np.abs(cosine), power)
    second = section.half_size[1] * np.sign(sine) * _powers(np.abs(sine), power)
    gone = np.concatenate([[0.0], np.cumsum(exact.hypot(np.diff(first), np.diff(second)))])
    even = np.linspace(0.0, gone[-1], around + 1)
    first, second = np.interp(even, gone, first), np.interp(even, gone, second)
    first[-1], second[-1] = first[0], second[0]
    return np.asarray(section.center) + first[:, None] * across_u + second[:, None] * across_v


def _powers(numbers: Floats, exponent: float) -> Floats:
    return np.array([exact.power(number, exponent) for number in numbers.tolist()])


def _cap(ring: Floats) -> Floats:
    return np.repeat(ring[:-1].mean(axis=0, keepdims=True), len(ring), axis=0)


def _faces(rings: int, around: int) -> np.ndarray:
    """Return the triangles between rings of `around` + 1 points, anticlockwise from outside.

    The first and the last ring are points on the axis, with one triangle per step only.
    """
    faces = []
    for ring in range(rings - 1):
        low = ring * (around + 1) + np.arange(around)
        high = low + around + 1
        if ring < rings - 2:
            faces.append(np.stack([low, high + 1, high], axis=1))
        if ring > 0:
            faces.append(np.stack([low, low + 1, high + 1], axis=1))
    return np.concatenate(faces).astype(np.int64)

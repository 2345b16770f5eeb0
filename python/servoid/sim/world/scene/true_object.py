"""The true shape of an object: the centroid of its volume, and points of its surface.

Its parts are closed and may overlap, so their union is determined by ray casting.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.sim.world.events.motions import pose_of, unit_row
from servoid.sim.world.scene.meshes import as_mesh
from servoid.sim.world.scene.visuals import Visual

_LINES = 64  # rays along each side of the object
_POINTS = 1500
_SEED = 7

Part = tuple[Floats, NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class TrueObject:
    """The shape of an object in its own frame.

    `middle` (3,) is the centroid of its volume; `points` (P, 3) are evenly spread on its surface,
    with outward `normals` (P, 3).
    """

    middle: Floats
    points: Floats
    normals: Floats


def true_object(visuals: Sequence[Visual]) -> TrueObject:
    """Compute the shape of an object that consists of solids."""
    parts = [_part(one) for one in visuals]
    points, normals = _surface(parts)
    return TrueObject(volume_middle(parts), points, normals)


def volume_middle(parts: Sequence[Part]) -> Floats:
    """Return the centroid (3,) of the union of closed parts, by a grid of rays along z."""
    corners = np.concatenate([vertices for vertices, _ in parts])
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    # The rays are shifted, so that they hardly hit vertices.
    shares = (np.arange(_LINES) + 0.503) / _LINES
    xs, ys = (lower[axis] + shares * (upper[axis] - lower[axis]) for axis in (0, 1))
    spans = [_crossed(part, xs, ys) for part in parts]
    total, first = 0.0, np.zeros(3)
    for i, x in enumerate(xs):
        for j, y in enumerate(ys):
            for start, end in _joined([span for part in spans for span in part[i][j]]):
                total += end - start
                first += (end - start) * np.array([x, y, 0.5 * (start + end)])
    return first / total


def inside(points: Floats, part: Part) -> NDArray[np.bool_]:
    """Return which points (P, 3) are inside a closed part, by the crossings of a ray upwards."""
    vertices, faces = part
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    found = np.zeros(len(points), np.bool_)
    for number, (x, y, z) in enumerate(points):
        weights, hit = _weights(a, b, c, x, y)
        heights = weights[0] * a[:, 2] + weights[1] * b[:, 2] + weights[2] * c[:, 2]
        found[number] = np.count_nonzero(hit & (heights > z)) % 2 == 1
    return found


def _part(visual: Visual) -> Part:
    mesh = as_mesh(visual.shape)
    place = pose_of(unit_row(visual.carrier_from_visual))
    return place.transform(np.ascontiguousarray(mesh.vertices)), np.asarray(mesh.faces, np.int64)


def _crossed(part: Part, xs: Floats, ys: Floats) -> list[list[list[tuple[float, float]]]]:
    """Return the intervals of z in which each ray at (x, y) is inside a part."""
    vertices, faces = part
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    found: list[list[list[tuple[float, float]]]] = []
    for x in xs:
        near = (np.minimum(np.minimum(a[:, 0], b[:, 0]), c[:, 0]) <= x) & (
            x <= np.maximum(np.maximum(a[:, 0], b[:, 0]), c[:, 0])
        )
        corners = a[near], b[near], c[near]
        found.append([_spans(*corners, float(x), float(y)) for y in ys])
    return found


def _spans(a: Floats, b: Floats, c: Floats, x: float, y: float) -> list[tuple[float, float]]:
    weights, hit = _weights(a, b, c, x, y)
    heights = weights[0] * a[:, 2] + weights[1] * b[:, 2] + weights[2] * c[:, 2]
    crossings = np.sort(heights[hit]).tolist()
    return list(zip(crossings[0::2], crossings[1::2], strict=False))


def _weights(
    a: Floats, b: Floats, c: Floats, x: float, y: float
) -> tuple[tuple[Floats, Floats, Floats], NDArray[np.bool_]]:
    """Return the barycentric coordinates (F, 3) of (x, y) in triangles, and which contain it."""
    ax, ay, bx, by, cx, cy = (one[:, axis] for one in (a, b, c) for axis in (0, 1))
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    area = np.where(area == 0.0, np.nan, area)
    second = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
    third = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
    first = 1.0 - second - third
    return (first, second, third), (first >= 0.0) & (second >= 0.0) & (third >= 0.0)


def _joined(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Merge overlapping intervals."""
    found: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if found and start <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((start, end))
    return found


def _surface(parts: Sequence[Part]) -> tuple[Floats, Floats]:
    """Return points (P, 3) spread evenly over the outer surface, and normals (P, 3)."""
    random = np.random.default_rng(_SEED)
    corners = np.concatenate([vertices[faces] for vertices, faces in parts])
    owner = np.concatenate([np.full(len(faces), n) for n, (_, faces) in enumerate(parts)])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.sqrt((across * across).sum(axis=1))
    summed = np.cumsum(areas)
    chosen = np.searchsorted(summed, summed[-1] * (np.arange(_POINTS) + 0.5) / _POINTS)
    u, v = random.random((2, _POINTS))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (corners[chosen, corner] for corner in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    kept = np.ones(_POINTS, np.bool_)
    for number, part in enumerate(parts):
        others = owner[chosen] != number
        kept[others] &= ~inside(points[others], part)
    normals = across[chosen] / areas[chosen, None]
    return points[kept], normals[kept]

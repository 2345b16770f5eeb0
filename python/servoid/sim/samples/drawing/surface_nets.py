"""Meshes a signed distance function by surface nets: one vertex in each cell on the surface."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats

_STEPS = 3  # steps of a vertex towards the surface

Distance = Callable[[Floats], Floats]


def surface_net(
    distance: Distance, low: Floats, high: Floats, spacing: float
) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices (N, 3) and faces (M, 3) of a closed surface, anticlockwise from outside.

    `distance` maps points (N, 3) to signed distances (N,), negative inside; the surface is within
    the box from `low` to `high` (3,). Cells are `spacing` wide.
    """
    counts = np.ceil((high - low) / spacing).astype(int) + 1
    axes = [low[axis] + spacing * np.arange(counts[axis]) for axis in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    inside = (distance(grid.reshape(-1, 3)) < 0.0).reshape(grid.shape[:3])
    held = np.zeros(counts - 1, int)
    for i, j, k in np.ndindex(2, 2, 2):
        held += inside[i : i + counts[0] - 1, j : j + counts[1] - 1, k : k + counts[2] - 1]
    crossed = (held > 0) & (held < 8)
    number = np.full(crossed.shape, -1, np.int64)
    number[crossed] = np.arange(np.count_nonzero(crossed))
    corners = low + spacing * (np.argwhere(crossed) + 0.5)
    for _ in range(_STEPS):
        slopes = _slopes(distance, corners, 0.1 * spacing)
        corners = corners - distance(corners)[:, None] * slopes
    faces = [_faces(inside, number, axis) for axis in range(3)]
    return corners, np.concatenate(faces)


def finer(
    distance: Distance, vertices: Floats, faces: NDArray[np.int64]
) -> tuple[Floats, NDArray[np.int64]]:
    """Subdivide each triangle into four, with the new vertices on the surface."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    pairs, which = np.unique(edges, axis=0, return_inverse=True)
    middles = vertices[pairs].mean(axis=1)
    step = 0.1 * float(np.linalg.norm(np.diff(vertices[pairs], axis=1), axis=2).mean())
    slopes = _slopes(distance, middles, step)
    middles = middles - distance(middles)[:, None] * slopes
    a, b, c = faces.T
    ab, bc, ca = (len(vertices) + which.reshape(-1, 3)).T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([vertices, middles]), np.concatenate([np.stack(one, 1) for one in parts])


def _slopes(distance: Distance, points: Floats, step: float) -> Floats:
    """Return the unit gradients (N, 3) of the distance."""
    found = np.stack(
        [distance(points + step * way) - distance(points - step * way) for way in np.eye(3)],
        axis=1,
    )
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def _faces(inside: NDArray[np.bool_], number: NDArray[np.int64], axis: int) -> NDArray[np.int64]:
    """Return two triangles for each grid edge along an axis that the surface crosses."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = inside.transpose(axis, first, second)
    cells = number.transpose(axis, first, second)
    start, end = turned[:-1, 1:-1, 1:-1], turned[1:, 1:-1, 1:-1]
    found = []
    for leaves in (True, False):
        at, b, c = np.nonzero((start & ~end) if leaves else (~start & end))
        # Anticlockwise around the edge, seen along its axis.
        ring = [cells[at, b, c], cells[at, b + 1, c], cells[at, b + 1, c + 1], cells[at, b, c + 1]]
        one, two, three, four = ring if leaves else ring[::-1]
        found += [np.stack([one, two, three], axis=1), np.stack([one, three, four], axis=1)]
    return np.concatenate(found)

"""The outer surface of convex solids that overlap, as triangles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.sim.samples.drawing.convex import Convex

_SPACING = 0.005  # metres between vertices around a solid's widest part


def outer_mesh(parts: Sequence[Convex]) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices (N, 3) and faces (M, 3) of the outer surface of the solids.

    The vertices lie on the surface; where solids meet, the triangles leave a narrow gap.
    """
    vertices, faces, count = [], [], 0
    for part in parts:
        ways, triangles = _sphere(int(np.pi * part.bound / _SPACING) + 4)
        points = part.surface(ways)
        inner = np.zeros(points.shape[1], np.bool_)
        for other in parts:
            if other is not part:
                inner |= other.holds(points)
        kept = triangles[~inner[triangles].any(axis=1)]
        used, order = np.unique(kept, return_inverse=True)
        vertices.append(points[:, used].T)
        faces.append(order.reshape(-1, 3) + count)
        count += len(used)
    return np.concatenate(vertices), np.concatenate(faces)


def obj_text(vertices: Floats, faces: NDArray[np.int64]) -> str:
    """Return a mesh as the text of an OBJ file, in metres."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return "\n".join(lines) + "\n"


def _sphere(levels: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return unit directions (3, N) and the triangles (M, 3) between them, seen from outside."""
    sides = 2 * levels
    rise = np.pi * (np.arange(1, levels) / levels - 0.5)
    around = 2.0 * np.pi * np.arange(sides) / sides
    rise, around = (grid.ravel() for grid in np.meshgrid(rise, around, indexing="ij"))
    ring = np.stack([np.cos(rise) * np.cos(around), np.cos(rise) * np.sin(around), np.sin(rise)])
    poles = np.array([[0.0, 0.0], [0.0, 0.0], [-1.0, 1.0]])
    bottom, top = ring.shape[1], ring.shape[1] + 1
    here = np.arange(sides)
    after = (here + 1) % sides
    triangles = [np.stack([np.full(sides, bottom), after, here], axis=1)]
    for row in range(0, ring.shape[1] - sides, sides):
        above = row + sides
        triangles.append(np.stack([row + here, row + after, above + here], axis=1))
        triangles.append(np.stack([row + after, above + after, above + here], axis=1))
    last = ring.shape[1] - sides
    triangles.append(np.stack([last + here, last + after, np.full(sides, top)], axis=1))
    return np.concatenate([ring, poles], axis=1), np.concatenate(triangles)

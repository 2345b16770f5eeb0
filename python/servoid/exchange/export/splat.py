"""Writes a body as Gaussians, in the PLY format of Gaussian splatting viewers."""

import numpy as np
from numpy.typing import NDArray

from servoid.exchange.export.solid import Piece, Solid

SPLATS = 1500  # on a whole ellipsoid
SIGMA = 0.65  # of a splat along the surface, as a share of the distance to the next
FLATNESS = 0.05  # thickness of a splat, as a share of its sigma along the surface
OPACITY = 0.99
_HARMONIC = 0.28209479177387814  # the spherical harmonic of degree 0

_FIELDS = (
    *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)

Array = NDArray[np.float64]


def splat_bytes(solid: Solid) -> bytes:
    """Return flat Gaussians on the surface of the union, each in its ellipsoid's colour.

    One Gaussian per ellipsoid would be a haze: half its light is outside the radius that contains
    the other half. Small flat ones on the surface look solid, with an edge as sharp as their size.
    """
    rows = [_splats(piece, index, solid.pieces) for index, piece in enumerate(solid.pieces)]
    table = np.concatenate(rows).astype("<f4")
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(table)}",
        *(f"property float {field}" for field in _FIELDS),
        "end_header\n",
    ]
    return "\n".join(header).encode() + table.tobytes()


def _splats(piece: Piece, index: int, pieces: tuple[Piece, ...]) -> Array:
    """Return the rows (N, 17) of one ellipsoid's Gaussians that no other ellipsoid covers."""
    directions = _spiral(SPLATS)
    points = directions @ piece.factor.T + piece.center
    bare = np.ones(SPLATS, bool)
    for other_index, other in enumerate(pieces):
        if other_index != index:
            inside = np.linalg.norm(_in_ball(other, points), axis=1)
            # If two ellipsoids coincide, the first keeps its surface.
            bare &= inside >= (1.0 if other_index < index else 1.0 - 1e-9)
    directions, points = directions[bare], points[bare]
    scales, quaternions = _shapes(piece, directions)
    normals = directions @ (piece.pose.matrix()[:3, :3] / piece.radii).T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    color = (np.array(piece.rgb) - 0.5) / _HARMONIC
    opacity = np.log(OPACITY / (1.0 - OPACITY))
    flat = np.broadcast_to([*color, opacity], (len(points), 4))
    return np.concatenate([points, normals, flat, np.log(scales), quaternions], axis=1)


def _shapes(piece: Piece, directions: Array) -> tuple[Array, Array]:
    """Return sigmas (N, 3) and rotations (N, 4) as (w, x, y, z) of the Gaussians.

    Each is a round disc on the unit ball, mapped by the transform from the ball to the ellipsoid:
    discs that cover the ball then cover the ellipsoid.
    """
    sigma = SIGMA * np.sqrt(4.0 * np.pi / SPLATS)
    along = np.einsum("ni,nj->nij", directions, directions)
    disc = sigma**2 * (np.eye(3) - along) + (FLATNESS * sigma) ** 2 * along
    variances, axes = np.linalg.eigh(piece.factor @ disc @ piece.factor.T)
    axes[:, :, 0] *= np.sign(np.linalg.det(axes))[:, None]
    least = 1e-12 * variances[:, 2:]
    return np.sqrt(np.maximum(variances, least)), _quaternions(axes)


def _spiral(count: int) -> Array:
    """Return unit vectors (count, 3) on a Fibonacci spiral: each has the same area around it."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height * height)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)


def _in_ball(piece: Piece, points: Array) -> Array:
    """Return points (N, 3) in the coordinates in which the ellipsoid is the unit ball."""
    return (points - piece.center) @ (piece.pose.matrix()[:3, :3] / piece.radii)


def _quaternions(rotations: Array) -> Array:
    """Return the unit quaternions (N, 4) as (w, x, y, z) of rotations (N, 3, 3)."""
    r = rotations
    trace = np.trace(r, axis1=1, axis2=2)
    # The largest of the four squares: no cancellation for any rotation.
    squares = np.stack([trace, r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]], axis=1)
    products = np.empty((len(r), 4, 4))
    products[:, 0, 0] = 1.0 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        products[:, i + 1, i + 1] = 1.0 + 2.0 * r[:, i, i] - trace
        products[:, 0, i + 1] = products[:, i + 1, 0] = r[:, k, j] - r[:, j, k]
        products[:, j + 1, k + 1] = products[:, k + 1, j + 1] = r[:, k, j] + r[:, j, k]
    chosen = products[np.arange(len(r)), squares.argmax(axis=1)]
    chosen *= np.where(chosen[:, :1] < 0.0, -1.0, 1.0)
    return chosen / np.linalg.norm(chosen, axis=1, keepdims=True)

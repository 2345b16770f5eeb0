"""Casts parallel rays at ellipsoids: exact surfaces, soft shadows, and light on paper."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]

_KEY_STRENGTH = 0.78
_AMBIENT_STRENGTH = 0.50
_RIM_STRENGTH = 0.22
_PAPER = np.array([246.0, 246.0, 244.0], np.float32)
_PENUMBRA = (0.88, 1.14)  # as multiples of an ellipsoid's size


@dataclass(frozen=True, eq=False)
class Solids:
    """Ellipsoids in the world: centers (K, 3), shapes R diag(r²) Rᵀ (K, 3, 3), colors (K, 3)."""

    centers: NDArray[np.float64]
    shapes: NDArray[np.float64]
    colors: NDArray[np.uint8]

    def extent(self, direction: NDArray[np.float64]) -> tuple[float, float]:
        """Return the lowest and highest coordinate along a unit direction, in metres."""
        middle = self.centers @ direction
        reach = np.sqrt(np.einsum("i,kij,j->k", direction, self.shapes, direction))
        return float((middle - reach).min()), float((middle + reach).max())


@dataclass(frozen=True, eq=False)
class Sight:
    """Parallel rays: `axes` (3, 3) has right, down and forward as rows, in the world."""

    axes: NDArray[np.float64]
    middle: NDArray[np.float64]
    metres_per_px: float
    size_px: tuple[int, int]

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels (N, 2) of points (N, 3) in the world."""
        across = (points - self.middle) @ self.axes[:2].T
        return across / self.metres_per_px + (np.array(self.size_px) - 1) / 2.0

    def finer(self, factor: float) -> "Sight":
        """Return the same sight with `factor` times as many pixels a side."""
        width, height = (round(side * factor) for side in self.size_px)
        return Sight(self.axes, self.middle, self.metres_per_px / factor, (width, height))


@dataclass(frozen=True, eq=False)
class Surface:
    """What rays (H, W) meet first: depth along the ray, inf for nothing, and which ellipsoid."""

    depth: Array
    owner: NDArray[np.int32]


def look(toward: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return axes (3, 3) for a sight along `toward` with `up` upwards; both are unit vectors."""
    right = np.cross(toward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def cast(solids: Solids, sight: Sight) -> Surface:
    """Meet ellipsoids with the rays of a sight, exactly."""
    width, height = sight.size_px
    depth = np.full((height, width), np.inf, np.float32)
    owner = np.full((height, width), -1, np.int32)
    for index, (center, shape) in enumerate(zip(solids.centers, solids.shapes, strict=True)):
        seen = sight.axes @ shape @ sight.axes.T / sight.metres_per_px**2
        u0, v0 = sight.project(center[None])[0]
        reach = np.sqrt(np.diag(seen))
        left, top = (max(0, int(np.ceil(low))) for low in (u0 - reach[0], v0 - reach[1]))
        columns, rows = (
            np.arange(left, min(width, int(u0 + reach[0]) + 1)),
            np.arange(top, min(height, int(v0 + reach[1]) + 1)),
        )
        if not len(columns) or not len(rows):
            continue
        across = np.stack(np.meshgrid(columns - u0, rows - v0)).astype(np.float32)
        flat = np.linalg.inv(seen[:2, :2])
        tilt = flat @ seen[:2, 2]
        room = 1.0 - np.einsum("ihw,ij,jhw->hw", across, flat.astype(np.float32), across)
        half = float(seen[2, 2] - seen[2, :2] @ tilt)
        ahead = float(sight.axes[2] @ (center - sight.middle)) / sight.metres_per_px
        with np.errstate(invalid="ignore"):
            front = ahead + tilt[0] * across[0] + tilt[1] * across[1] - np.sqrt(half * room)
        block = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        nearer = front * sight.metres_per_px < depth[block]
        depth[block] = np.where(nearer, front * sight.metres_per_px, depth[block])
        owner[block][nearer] = index
    return Surface(depth, owner)


def shade(solids: Solids, sight: Sight, surface: Surface, light: NDArray[np.float64]) -> Array:
    """Return the colours (N, 3), 0 to 255, of the pixels that meet an ellipsoid, in order."""
    rows, columns = np.nonzero(surface.owner >= 0)
    owner = surface.owner[rows, columns]
    width, height = sight.size_px
    in_sight = np.stack(
        [
            (columns - (width - 1) / 2.0) * sight.metres_per_px,
            (rows - (height - 1) / 2.0) * sight.metres_per_px,
            surface.depth[rows, columns],
        ]
    ).astype(np.float32)
    points = sight.axes.T.astype(np.float32) @ in_sight
    points += sight.middle.astype(np.float32)[:, None]
    normals = np.zeros_like(points)
    for index, (center, shape) in enumerate(zip(solids.centers, solids.shapes, strict=True)):
        own = owner == index
        offset = points[:, own] - center.astype(np.float32)[:, None]
        normals[:, own] = np.linalg.inv(shape).astype(np.float32) @ offset
    normals /= np.sqrt((normals * normals).sum(axis=0))
    lit, open_share = light_and_sky(solids, points, normals, light, owner)
    up = -sight.axes[1].astype(np.float32)
    key = _KEY_STRENGTH * lit * np.maximum(light.astype(np.float32) @ normals, 0)
    ambient = _AMBIENT_STRENGTH * open_share * (0.78 + 0.22 * (up @ normals))
    rim = (1.0 + np.minimum(sight.axes[2].astype(np.float32) @ normals, 0.0)) ** 3
    color = (solids.colors[owner].astype(np.float32) / 255.0) ** 2.2
    glow = _RIM_STRENGTH * (rim * open_share)[:, None]
    radiance = color * (key + ambient)[:, None] + glow * (0.35 * color + 0.10)
    return np.asarray(255.0 * np.clip(1.12 * radiance, 0.0, 1.0) ** (1 / 2.2), np.float32)


def light_and_sky(
    solids: Solids,
    points: Array,
    normals: Array,
    light: NDArray[np.float64],
    owner: NDArray[np.int32] | None = None,
) -> tuple[Array, Array]:
    """Return how much light and sky points (3, N) see past the ellipsoids that are not theirs."""
    lit = np.ones(points.shape[1], np.float32)
    open_share = np.ones(points.shape[1], np.float32)
    for index, (center, shape) in enumerate(zip(solids.centers, solids.shapes, strict=True)):
        offset = center.astype(np.float32)[:, None] - points
        # In these coordinates the ellipsoid is the unit ball.
        ball = np.linalg.inv(np.linalg.cholesky(shape)).astype(np.float32)
        away = ball @ offset
        squared = (away * away).sum(axis=0)
        ray = ball @ light.astype(np.float32)
        along = (ray @ away) / np.float32(np.linalg.norm(ray))
        miss = np.sqrt(np.maximum(squared - along * along, 0))
        clear = np.clip((miss - _PENUMBRA[0]) / (_PENUMBRA[1] - _PENUMBRA[0]), 0, 1)
        clear = np.where(along > 0, clear * clear * (3 - 2 * clear), 1)
        toward = (normals * offset).sum(axis=0) / np.sqrt((offset * offset).sum(axis=0))
        hidden = np.maximum(toward, 0) / np.maximum(squared, 1)
        others = np.ones_like(lit) if owner is None else (owner != index)
        lit *= np.where(others, clear, 1)
        open_share *= np.where(others, 1 - 0.85 * hidden, 1)
    return lit, open_share


def paper(
    solids: Solids, sight: Sight, up: NDArray[np.float64], light: NDArray[np.float64]
) -> Array:
    """Return the light paper (H, W, 3), 0 to 255, on which the body stands, with its shadow."""
    width, height = sight.size_px
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    across = np.stack([u.ravel() - (width - 1) / 2.0, v.ravel() - (height - 1) / 2.0])
    start = sight.middle[:, None] + sight.axes[:2].T @ (across * sight.metres_per_px)
    lowest = solids.extent(up)[0]
    fall = float(sight.axes[2] @ up)
    points = (start + sight.axes[2][:, None] * ((lowest - up @ start) / fall)).astype(np.float32)
    normals = np.broadcast_to(up.astype(np.float32)[:, None], points.shape)
    lit, open_share = light_and_sky(solids, points, normals, light)
    share = (1.0 - 0.20 * (1.0 - lit)) * (1.0 - 0.42 * (1.0 - open_share))
    return (share[:, None] * _PAPER).reshape(height, width, 3).astype(np.float32)


def render(
    solids: Solids, sight: Sight, up: NDArray[np.float64], light: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) RGB of the ellipsoids on light paper, its edges smoothed."""
    import cv2

    fine = sight.finer(1.5)
    coarse = paper(solids, sight.finer(0.5), up, light)
    canvas = cv2.resize(coarse, fine.size_px, interpolation=cv2.INTER_CUBIC)
    surface = cast(solids, fine)
    canvas[surface.owner >= 0] = shade(solids, fine, surface, light)
    picture = cv2.resize(canvas, sight.size_px, interpolation=cv2.INTER_AREA)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)

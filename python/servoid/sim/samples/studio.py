"""The sample's photographs: cameras around a table, a key light, a sky, a lens and a sensor."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.sim.samples import bird
from servoid.sim.samples.drawing import tracing
from servoid.sim.samples.drawing.solids import Array

_KEY_LIGHT: Array = np.array([0.42078, -0.46085, 0.78141], np.float32)  # of length 1
_KEY_COLOR = np.array([1.95, 1.80, 1.55], np.float32)
_SKY_COLOR = np.array([0.46, 0.51, 0.60], np.float32)
_BOUNCE_COLOR = np.array([0.20, 0.16, 0.12], np.float32)
_TABLE_COLOR = np.array([0.345, 0.305, 0.265], np.float32)
_THREADS = (  # pitch along x and y in metres, and strength
    (0.0012, 0.006, 0.24),
    (0.006, 0.0012, 0.24),
    (0.011, 0.011, 0.10),
    (0.07, 0.05, 0.14),
)
_TILE_PX = 8
_LENS_BLUR_PX = 0.55
_SENSOR_NOISE = 1.6  # standard deviation in grey levels
_ELEVATIONS_DEG = (17.0, 38.0, 60.0)


@dataclass(frozen=True)
class Shot:
    """One photograph to take: a pinhole camera and its pose `world_from_camera` (4, 4)."""

    size_px: tuple[int, int]
    focal_px: float
    center_px: tuple[float, float]
    world_from_camera: NDArray[np.float64]


def plan_shots(count: int, size_px: tuple[int, int]) -> list[Shot]:
    """Return `count` shots once around the table, from three heights in turn."""
    width, height = size_px
    shots = []
    for index in range(count):
        azimuth = 2.0 * np.pi * (index + 0.35) / count
        elevation = np.radians(_ELEVATIONS_DEG[index % len(_ELEVATIONS_DEG)])
        # No hand holds a camera at the same distance twice.
        away = 0.53 + 0.02 * np.sin(2.4 * index)
        aim = np.array([-0.008, 0.010, 0.092]) + 0.006 * np.sin([1.7 * index, 2.9 * index, index])
        toward = np.array(
            [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
        )
        pose = look_at(aim + away * toward, aim)
        center_px = ((width - 1) / 2.0, (height - 1) / 2.0)
        shots.append(Shot(size_px, 1.35 * width, center_px, pose))
    return shots


def look_at(position: NDArray[np.float64], aim: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the pose `world_from_camera` (4, 4) of a level camera that looks at `aim`."""
    forward = (aim - position) / np.linalg.norm(aim - position)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = position
    return pose


def photograph(shot: Shot, seed: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Take one photograph: the image (H, W, 3) RGB and the bird's mask (H, W), 255 inside."""
    width, height = shot.size_px
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    origins, directions = _rays(shot, u.ravel(), v.ravel())
    depths = tracing.first_hits(bird.distance, origins, directions, _ray_limits(shot))
    seen = ~np.isnan(depths)
    light = _table_light(origins, directions)
    points = origins[:, seen] + depths[seen] * directions[:, seen]
    light[:, seen] = _bird_light(np.asarray(points, np.float32), directions[:, seen])
    mask = np.where(seen, np.uint8(255), np.uint8(0)).reshape(height, width)
    return _develop(light.T.reshape(height, width, 3), seed), mask


def _rays(shot: Shot, u: NDArray[Any], v: NDArray[Any]) -> tuple[Array, Array]:
    """Return origins and unit directions (3, N) in the world of rays through pixels (u, v)."""
    x = (u - shot.center_px[0]) / shot.focal_px
    y = (v - shot.center_px[1]) / shot.focal_px
    rotation = shot.world_from_camera[:3, :3]
    directions = rotation[:, :1] * x + rotation[:, 1:2] * y + rotation[:, 2:]
    directions /= np.sqrt((directions * directions).sum(axis=0))
    origins = np.broadcast_to(shot.world_from_camera[:3, 3:], directions.shape)
    return origins.astype(np.float32), directions.astype(np.float32)


def _ray_limits(shot: Shot) -> Array:
    """Return where each pixel's ray may meet the bird, (2, H * W), found tile by tile."""
    width, height = shot.size_px
    columns, rows = -(-width // _TILE_PX), -(-height // _TILE_PX)
    middle = (_TILE_PX - 1) / 2.0
    u, v = np.meshgrid(np.arange(columns), np.arange(rows))
    origins, axes = _rays(shot, u.ravel() * _TILE_PX + middle, v.ravel() * _TILE_PX + middle)
    spread = 1.05 * middle * np.sqrt(2.0) / shot.focal_px
    # The ball is grown by what the tile's own rays may lean off its middle.
    grown = bird.BOUND_RADIUS + spread * 1.0
    limits = tracing.sphere_range(origins, axes, bird.BOUND_CENTER, grown)
    limits = tracing.tighten(bird.distance, origins, axes, spread, limits)
    tiles = limits.reshape(2, rows, columns).repeat(_TILE_PX, axis=1).repeat(_TILE_PX, axis=2)
    return tiles[:, :height, :width].reshape(2, -1)


def _bird_light(points: Array, directions: Array) -> Array:
    """Return the linear light (3, N) that painted wood sends back along the rays."""
    normal = tracing.normals(bird.distance, points)
    lifted = points + np.float32(0.0012) * normal
    facing = np.maximum((normal * _KEY_LIGHT[:, None]).sum(axis=0), 0)
    limits = tracing.sphere_range(
        lifted,
        np.broadcast_to(_KEY_LIGHT[:, None], lifted.shape),
        bird.BOUND_CENTER,
        bird.BOUND_RADIUS,
    )
    limits[0, facing <= 0] = np.nan
    key = facing * tracing.light_seen(bird.distance, lifted, _KEY_LIGHT, limits)
    openness = tracing.sky_seen(_with_table, points, normal)
    upward = np.float32(0.5) + np.float32(0.5) * normal[2]
    ambient = openness * (
        _SKY_COLOR[:, None] * upward + _BOUNCE_COLOR[:, None] * (np.float32(1) - upward)
    )
    half = _KEY_LIGHT[:, None] - directions
    half /= np.sqrt((half * half).sum(axis=0))
    shine = np.maximum((normal * half).sum(axis=0), 0) ** np.float32(48) * key
    grazing = (np.float32(1) + (normal * directions).sum(axis=0)) ** np.float32(4)
    gloss = np.float32(0.16) * shine + np.float32(0.10) * grazing * openness
    return bird.paint(points) * (_KEY_COLOR[:, None] * key + ambient) + gloss


def _with_table(points: Array) -> Array:
    """Return the distance of points (3, N) to the nearer of bird and table."""
    return np.minimum(bird.distance(points), points[2])


def _table_light(origins: Array, directions: Array) -> Array:
    """Return the linear light (3, N) of the table and, far off, of the backdrop."""
    below = directions[2] < np.float32(-1e-3)
    reach = np.where(below, -origins[2] / np.where(below, directions[2], -1), np.float32(1e3))
    points = origins + reach * directions
    points[2] = 0
    away = np.sqrt(points[0] ** 2 + points[1] ** 2)
    up = np.zeros_like(points)
    up[2] = 1
    limits = tracing.sphere_range(
        points,
        np.broadcast_to(_KEY_LIGHT[:, None], points.shape),
        bird.BOUND_CENTER,
        bird.BOUND_RADIUS,
    )
    key = _KEY_LIGHT[2] * tracing.light_seen(bird.distance, points, _KEY_LIGHT, limits)
    openness = np.ones_like(away)
    near = np.flatnonzero(away < np.float32(0.14))
    openness[near] = tracing.sky_seen(bird.distance, points[:, near], up[:, near])
    lit = _KEY_COLOR[:, None] * key + _SKY_COLOR[:, None] * openness
    table = _TABLE_COLOR[:, None] * _weave(points) * lit
    fade = np.clip((away - np.float32(0.35)) / np.float32(1.1), 0, 1)
    backdrop = np.array([0.40, 0.42, 0.44], np.float32)[:, None] * np.ones_like(table)
    return table + fade * fade * (np.float32(3) - np.float32(2) * fade) * (backdrop - table)


def _weave(points: Array) -> Array:
    """Return the brightness (N,), about 1, of the table's cloth."""
    pattern = np.random.default_rng(7).random((256, 256)).astype(np.float32)
    shade = np.ones(points.shape[1], np.float32)
    for across, along, strength in _THREADS:
        u, v = points[0] / np.float32(across), points[1] / np.float32(along)
        shade += np.float32(strength) * (_lattice(pattern, u, v) - np.float32(0.5))
    return shade


def _lattice(pattern: Array, u: Array, v: Array) -> Array:
    """Return a repeating random pattern (256, 256), interpolated at (u, v)."""
    column, row = np.floor(u), np.floor(v)
    right, down = u - column, v - row
    i, j = row.astype(np.int64) & 255, column.astype(np.int64) & 255
    k, m = (i + 1) & 255, (j + 1) & 255
    top = pattern[i, j] + right * (pattern[i, m] - pattern[i, j])
    bottom = pattern[k, j] + right * (pattern[k, m] - pattern[k, j])
    return np.asarray(top + down * (bottom - top), np.float32)


def _develop(light: Array, seed: int) -> NDArray[np.uint8]:
    """Turn linear light (H, W, 3) into an 8-bit photograph: lens, tone curve, sensor noise."""
    import cv2  # slow to import, and help texts do not need it

    blurred = cv2.GaussianBlur(light, (0, 0), _LENS_BLUR_PX)
    height, width = light.shape[:2]
    v, u = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j].astype(np.float32)
    blurred *= (np.float32(1) - np.float32(0.11) * (u * u + v * v))[:, :, None]
    toned = np.float32(1) - np.exp(-np.float32(1.25) * blurred)
    levels = np.float32(255) * np.clip(toned * np.float32(1.12), 0, 1) ** np.float32(1 / 2.2)
    levels += np.random.default_rng(seed).normal(0.0, _SENSOR_NOISE, levels.shape)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)

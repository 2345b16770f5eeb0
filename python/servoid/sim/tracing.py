"""Sphere tracing of a signed distance in plain numpy: first hits, normals, shadow, occlusion."""

from collections.abc import Callable

import numpy as np

from servoid.sim.solids import Array, Triple

Distance = Callable[[Array], Array]

_CHUNK = 8192  # rays at a time: their temporaries stay in the processor's cache
_MAX_STEPS = 128
_LEAST_STEP = 1e-4  # metres: rays that graze the surface do not stall
_CONE_STEPS = 24
_TOLERANCE = 4e-5  # metres, a fifteenth of a pixel in the sample
_SHADOW_STEPS = 18
_SHADOW_SHARPNESS = 9.0


def sphere_range(origins: Array, directions: Array, center: Triple, radius: float) -> Array:
    """Return where rays (3, N) enter and leave a ball, as (2, N); rays that miss get NaN."""
    offset = origins - np.asarray(center, np.float32)[:, None]
    along = -(offset * directions).sum(axis=0)
    squared = np.float32(radius * radius) - (offset * offset).sum(axis=0) + along * along
    half = np.sqrt(np.where(squared > 0, squared, np.float32(np.nan)))
    return np.stack([np.maximum(along - half, 0), along + half])


def tighten(distance: Distance, origins: Array, axes: Array, spread: float, limits: Array) -> Array:
    """Return `limits` (2, N) moved forward over the empty part of cones of rays; NaN if all empty.

    A cone holds every ray that leaves its origin at less than `spread` radians from its axis.
    """
    tight = np.full_like(limits, np.nan)
    active = np.flatnonzero(~np.isnan(limits[0]))
    origins, axes, (travelled, leave) = origins[:, active], axes[:, active], limits[:, active]
    for _ in range(_CONE_STEPS):
        # Nothing is nearer than the distance, whichever way the ray leans off the axis.
        safe = (travelled + distance(origins + travelled * axes)) * np.float32(1 / (1 + spread))
        stuck = safe - travelled < np.float32(0.25 * spread) * travelled
        tight[:, active[stuck]] = np.stack([travelled[stuck], leave[stuck]])
        keep = ~stuck & (safe < leave)
        active, travelled, leave = active[keep], safe[keep], leave[keep]
        origins, axes = origins[:, keep], axes[:, keep]
    tight[:, active] = np.stack([travelled, leave])
    return tight


def first_hits(distance: Distance, origins: Array, directions: Array, limits: Array) -> Array:
    """Return how far rays (3, N) travel to the surface within `limits` (2, N); NaN where none."""
    depths = np.full(limits.shape[1], np.nan, np.float32)
    candidates = np.flatnonzero(~np.isnan(limits[0]))
    for first in range(0, len(candidates), _CHUNK):
        chunk = candidates[first : first + _CHUNK]
        depths[chunk] = _march(distance, origins[:, chunk], directions[:, chunk], limits[:, chunk])
    return depths


def _march(distance: Distance, origins: Array, directions: Array, limits: Array) -> Array:
    """Walk rays (3, N) by safe steps until they touch the surface or leave their limits."""
    depths = np.full(limits.shape[1], np.nan, np.float32)
    active = np.arange(limits.shape[1])
    travelled, leave = limits[0].copy(), limits[1]
    for _ in range(_MAX_STEPS):
        step = distance(origins + travelled * directions)
        hit = step < np.float32(_TOLERANCE)
        depths[active[hit]] = travelled[hit]
        travelled = travelled + np.maximum(step, np.float32(_LEAST_STEP))
        keep = ~hit & (travelled < leave)
        active, travelled, leave = active[keep], travelled[keep], leave[keep]
        origins, directions = origins[:, keep], directions[:, keep]
        if len(active) == 0:
            break
    return depths


def normals(distance: Distance, points: Array) -> Array:
    """Return unit normals (3, N) at points (3, N), by differences over a tetrahedron."""
    found = np.zeros_like(points)
    corners = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], np.float32)
    for first in range(0, points.shape[1], _CHUNK):
        chunk = slice(first, first + _CHUNK)
        for corner in corners:
            direction = corner[:, None]
            found[:, chunk] += direction * distance(points[:, chunk] + np.float32(4e-4) * direction)
    return found / np.sqrt((found * found).sum(axis=0))


def light_seen(distance: Distance, points: Array, light: Array, limits: Array) -> Array:
    """Return how much of a wide light points (3, N) see, 0 to 1; `limits` (2, N) bound the walk."""
    seen = np.ones(points.shape[1], np.float32)
    candidates = np.flatnonzero(~np.isnan(limits[0]))
    for first in range(0, len(candidates), _CHUNK):
        chunk = candidates[first : first + _CHUNK]
        seen[chunk] = _soft_shadow(distance, points[:, chunk], light, limits[:, chunk])
    return seen


def _soft_shadow(distance: Distance, points: Array, light: Array, limits: Array) -> Array:
    """Walk towards the light; the nearest miss, against the way walked, tells the penumbra."""
    seen = np.ones(points.shape[1], np.float32)
    active = np.arange(points.shape[1])
    travelled, leave = np.maximum(limits[0], np.float32(0.0015)), limits[1]
    for _ in range(_SHADOW_STEPS):
        step = distance(points + travelled * light[:, None])
        share = np.float32(_SHADOW_SHARPNESS) * step / travelled
        seen[active] = np.minimum(seen[active], np.maximum(share, 0))
        travelled = travelled + np.maximum(step, np.float32(0.003))
        keep = (seen[active] > np.float32(0.01)) & (travelled < leave)
        active, points = active[keep], points[:, keep]
        travelled, leave = travelled[keep], leave[keep]
        if len(active) == 0:
            break
    return seen * seen * (np.float32(3) - np.float32(2) * seen)


def sky_seen(distance: Distance, points: Array, directions: Array) -> Array:
    """Return how open space is above points (3, N) along their normals (3, N), 0 to 1."""
    open_share = np.ones(points.shape[1], np.float32)
    for first in range(0, points.shape[1], _CHUNK):
        chunk = slice(first, first + _CHUNK)
        for reach, weight in ((0.006, 18.0), (0.016, 9.0), (0.036, 4.5), (0.070, 2.2)):
            probe = points[:, chunk] + np.float32(reach) * directions[:, chunk]
            missing = np.float32(reach) - distance(probe)
            open_share[chunk] -= np.float32(weight) * np.maximum(missing, 0)
    return np.clip(open_share, 0.0, 1.0)

"""Sphere tracing of a signed distance in plain numpy: first hits, normals, shadow, occlusion."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from servoid.sim.samples.drawing.solids import Array, Triple

Distance = Callable[[Array], Array]

_CHUNK = 12288  # rays at a time: their temporaries stay in the processor's cache
_STEPS = (20, 480)  # of every ray; then of the few that graze the surface, all at once
_LEAST_STEP = 6e-4  # metres: rays that graze the surface do not stall
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
    travelled = limits[0].copy()
    active = np.flatnonzero(~np.isnan(travelled))
    for steps in _STEPS:
        left = [np.empty(0, np.intp)]
        for first in range(0, len(active), _CHUNK):
            chunk = active[first : first + _CHUNK]
            near, hit, left_over = _march(
                distance,
                (origins[:, chunk], directions[:, chunk]),
                travelled[chunk],
                limits[1, chunk],
                steps,
            )
            travelled[chunk] = near
            depths[chunk[hit]] = near[hit]
            left.append(chunk[left_over])
        active = np.concatenate(left)
    return depths


def _march(
    distance: Distance, rays: tuple[Array, Array], start: Array, leave: Array, steps: int
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Walk rays by safe steps; return how far they came, which ones hit, and which are under way.

    `rays` are origins and directions (3, N); `start` and `leave` (N,) bound the walk.
    """
    reached = start.copy()
    hits = [np.empty(0, np.intp)]
    active = np.arange(len(start))
    origins, directions = rays
    for _ in range(steps):
        if len(active) == 0:
            break
        step = distance(origins + reached[active] * directions)
        hit = step < np.float32(_TOLERANCE)
        hits.append(active[hit])
        going = active[~hit]
        reached[going] += np.maximum(step[~hit], np.float32(_LEAST_STEP))
        keep = ~hit
        keep[keep] = reached[going] < leave[going]
        active, origins, directions = active[keep], origins[:, keep], directions[:, keep]
    return reached, np.concatenate(hits), active


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

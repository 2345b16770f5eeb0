"""Pictures of drawables made of convex solids: each drawable is one layer, lit and anti-aliased."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.sim.samples.drawing.convex import Convex, Floats

Paint = Callable[[Floats, int], Floats]

_KEY_COLOR = np.array([0.86, 0.80, 0.70])[:, None]
_SKY_COLOR = np.array([0.34, 0.37, 0.42])[:, None]
_BOUNCE_COLOR = np.array([0.17, 0.14, 0.11])[:, None]
_SHINE_POWER = 40.0
_NEAREST = 0.02  # metres before the camera at which things begin to be seen
_SHADE_OFFSET = 2e-4  # metres: a point does not lie in the shade of its own surface


@dataclass(frozen=True, eq=False)
class Pinhole:
    """A pinhole camera whose every pixel is seen as `subpixels` times `subpixels` rays."""

    size_px: tuple[int, int]
    focal_px: float
    center_px: tuple[float, float]
    subpixels: int


@dataclass(frozen=True, eq=False)
class Lamp:
    """A far light and the sky, as unit directions (3,) towards them in one frame."""

    toward: Floats
    up: Floats

    def within(self, frame_from_room: Floats) -> "Lamp":
        """Return the same lamp as a drawable's own frame sees it; the motion is (4, 4)."""
        turn = frame_from_room[:3, :3]
        return Lamp(turn @ self.toward, turn @ self.up)


@dataclass(frozen=True, eq=False)
class Drawable:
    """Solids in a frame of their own, and what paint they wear: linear colours (3, N).

    The first `backdrops` of the parts throw no shade, such as the floor.
    """

    parts: Sequence[Convex]
    paint: Paint
    gloss: float = 0.0
    backdrops: int = 0


@dataclass(frozen=True, eq=False)
class Layer:
    """What a camera sees of one drawable: light (H, W, 3), and the share of each pixel (H, W)."""

    light: Floats
    cover: Floats

    def over(self, light: Floats) -> Floats:
        """Return another picture (H, W, 3) with this drawable in front of it."""
        return self.light + (1.0 - self.cover[:, :, None]) * light


def see(drawable: Drawable, camera: Pinhole, frame_from_camera: Floats, lamp: Lamp) -> Layer:
    """Return what a camera at the pose (4, 4) sees of a drawable; the lamp is in its frame."""
    width, height = camera.size_px
    light, cover = np.zeros((height, width, 3)), np.zeros((height, width))
    windows = [_window(part, camera, frame_from_camera) for part in drawable.parts]
    u0, v0 = (min(window[axis] for window in windows) for axis in (0, 1))
    u1, v1 = (max(window[axis] for window in windows) for axis in (2, 3))
    if u0 >= u1 or v0 >= v1:
        return Layer(light, cover)
    x, y = _rays(camera, (u0, u1), 0), _rays(camera, (v0, v1), 1)
    depth, which = np.full((len(y), len(x)), np.inf), np.full((len(y), len(x)), -1, np.int16)
    for index, (part, (a, b, c, d)) in enumerate(zip(drawable.parts, windows, strict=True)):
        n = camera.subpixels
        columns, rows = slice((a - u0) * n, (c - u0) * n), slice((b - v0) * n, (d - v0) * n)
        enter, leave = part.crossing(frame_from_camera, x[columns], y[rows])
        seen = (enter < leave) & (enter > _NEAREST) & (enter < depth[rows, columns])
        depth[rows, columns][seen] = enter[seen]
        which[rows, columns][seen] = index
    colors = _light(drawable, frame_from_camera, lamp, (x, y, depth, which))
    shape = (v1 - v0, camera.subpixels, u1 - u0, camera.subpixels)
    light[v0:v1, u0:u1] = colors.reshape(*shape, 3).mean(axis=(1, 3))
    cover[v0:v1, u0:u1] = (which >= 0).reshape(shape).mean(axis=(1, 3))
    return Layer(light, cover)


def _rays(camera: Pinhole, pixels: tuple[int, int], axis: int) -> Floats:
    """Return x, or y, of the rays (N,) through the parts of a range of columns, or rows."""
    n = camera.subpixels
    inside = (np.arange(n) + 0.5) / n - 0.5
    places = (np.arange(*pixels)[:, None] + inside).ravel()
    return (places - camera.center_px[axis]) / camera.focal_px


def _window(part: Convex, camera: Pinhole, frame_from_camera: Floats) -> tuple[int, int, int, int]:
    """Return the columns and rows (u0, v0, u1, v1) outside which a solid is not seen."""
    width, height = camera.size_px
    center = frame_from_camera[:3, :3].T @ (part.center - frame_from_camera[:3, 3])
    if center[2] + part.bound < _NEAREST:
        return width, height, 0, 0
    if center[2] - part.bound < _NEAREST:
        return 0, 0, width, height
    ends = center[:2, None] + part.bound * np.array([-1.0, 1.0])
    depths = center[2] + part.bound * np.array([-1.0, 1.0])
    pixels = camera.focal_px * (ends[:, :, None] / depths).reshape(2, 4)
    low = np.floor(pixels.min(axis=1) + camera.center_px - 0.5).astype(int)
    high = np.ceil(pixels.max(axis=1) + camera.center_px + 1.5).astype(int)
    u0, v0 = np.clip(low, 0, camera.size_px)
    u1, v1 = np.clip(high, 0, camera.size_px)
    return int(u0), int(v0), int(max(u0, u1)), int(max(v0, v1))


def _light(
    drawable: Drawable,
    frame_from_camera: Floats,
    lamp: Lamp,
    seen: tuple[Floats, Floats, Floats, NDArray[np.int16]],
) -> Floats:
    """Return the light (rows, columns, 3) of seen places: x, y, depth and part; else black."""
    x, y, depth, which = seen
    light = np.zeros((*which.shape, 3))
    for index, part in enumerate(drawable.parts):
        rows, columns = np.nonzero(which == index)
        if len(rows) == 0:
            continue
        rays = np.stack([x[columns], y[rows], np.ones(len(rows))])
        ways = frame_from_camera[:3, :3] @ rays
        points = frame_from_camera[:3, 3:] + depth[rows, columns] * ways
        normals = part.normals(part.to_local(points))
        ways /= np.sqrt((ways * ways).sum(axis=0))
        key = key_light(drawable, points, normals, lamp)
        half = lamp.toward[:, None] - ways
        half /= np.sqrt((half * half).sum(axis=0))
        shine = np.maximum((half * normals).sum(axis=0), 0.0) ** _SHINE_POWER * (key > 0.0)
        painted = drawable.paint(points, index) * received(normals, key, lamp)
        light[rows, columns] = (painted + drawable.gloss * shine).T
    return light


def key_light(drawable: Drawable, points: Floats, normals: Floats, lamp: Lamp) -> Floats:
    """Return how squarely points (3, N) on a drawable face the far light (N,), 0 in the shade."""
    facing = np.maximum(lamp.toward @ normals, 0.0)
    lit = np.flatnonzero(facing)
    lifted = points[:, lit] + _SHADE_OFFSET * normals[:, lit]
    # Only what the far light sees through a part's ball can be in that part's shade.
    across = np.linalg.svd(lamp.toward[None])[2][1:]
    u, v = across @ lifted
    for part in drawable.parts[drawable.backdrops :]:
        middle = across @ part.center
        near = np.abs(u - middle[0]) < part.bound
        near &= np.abs(v - middle[1]) < part.bound
        found = np.flatnonzero(near)
        shaded = found[part.shades(lifted[:, found], lamp.toward)]
        facing[lit[shaded]] = 0.0
    return facing


def received(normals: Floats, key: Floats, lamp: Lamp) -> Floats:
    """Return the light (3, N) that falls onto surfaces: the far light's share, sky and bounce."""
    upward = 0.5 + 0.5 * (lamp.up @ normals)
    return _KEY_COLOR * key + _SKY_COLOR * upward + _BOUNCE_COLOR * (1.0 - upward)

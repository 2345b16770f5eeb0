"""Converts procedural paint, a function of position, to textures of convex solids."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats, Pose
from servoid.sim.samples.drawing.convex import Convex
from servoid.sim.samples.drawing.patterns import GAMMA
from servoid.sim.samples.drawing.solids import Triple
from servoid.sim.world.events.motions import row_of
from servoid.sim.world.scene.visuals import ROOM, Cylinder, Ellipsoid, Finish, Plane, Shape, Visual

Paint = Callable[[Floats], Floats]
"""Maps points (3, N) in the frame of an object to linear colours (3, N), 0 to 1."""

_LID = 5e-5  # metres: half the height of a tube's lids, a fifth of which protrudes
_FACES = ((1, 2, 0), (2, 0, 1), (0, 1, 2))  # along, across and outwards, for each axis of a box


def painted(
    part: Convex, paint: Paint, *, texel: float, carrier: str, gloss: float = 0.0
) -> list[Visual]:
    """Return the painted visuals of a solid, with pixels `texel` metres apart."""

    def visual(shape: Shape, turn: Floats, place: Floats, at: Floats) -> Visual:
        turned, placed = part.axes.T @ turn, part.center + part.axes.T @ place
        return _visual(shape, (turned, placed), at, paint, carrier=carrier, gloss=gloss)

    still, middle = np.eye(3), np.zeros(3)
    size = part.radii.min(axis=0)
    if len(part.radii) == 1:
        x, y, z = (float(one) for one in size)
        return [visual(Ellipsoid((x, y, z)), still, middle, _around(size, texel))]
    if len(part.radii) == 2:
        radius, half = float(size[0]), float(size[2])
        seen = [visual(Cylinder(radius, half), still, middle, _wall(radius, half, texel))]
        for side in (-1.0, 1.0):
            lid = np.array([0.0, 0.0, side * (half - 0.8 * _LID)])
            at = _flat((radius, radius), texel)
            at[2] = side * _LID
            seen.append(visual(Cylinder(radius, _LID), still, lid, at))
        return seen
    seen = []
    for along, across, out in _FACES:
        for side in (-1.0, 1.0):
            half_size = (float(size[along]), float(size[across]))
            turn, place = np.zeros((3, 3)), np.zeros(3)
            turn[along, 0], turn[across, 1], turn[out, 2] = side, 1.0, side
            place[out] = side * size[out]
            seen.append(visual(Plane(half_size), turn, place, _flat(half_size, texel)))
    return seen


def flat_painted(
    center: Triple, half_size: tuple[float, float], turn: Floats, paint: Paint, *, texel: float
) -> Visual:
    """Return a painted rectangle of the room; `turn` (3, 3) has its axes as columns."""
    pose = turn, np.array(center)
    return _visual(Plane(half_size), pose, _flat(half_size, texel), paint, carrier=ROOM)


def _visual(
    shape: Shape,
    pose: tuple[Floats, Floats],
    at: Floats,
    paint: Paint,
    *,
    carrier: str,
    gloss: float = 0.0,
) -> Visual:
    """Return a shape with rotation (3, 3) and position (3,), painted at points (3, H, W)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose
    points = pose[0] @ at.reshape(3, -1) + pose[1][:, None]
    finish = Finish(texture=texture_of(paint(points), at.shape[1:]), gloss=gloss)
    return Visual(shape, finish, carrier, row_of(Pose(matrix)))


def _middles(length: float, texel: float) -> Floats:
    """Return the centres of a texture's pixels along one side, as shares of it."""
    count = max(1, int(np.ceil(length / texel)))
    return (np.arange(count) + 0.5) / count


def _around(radii: Floats, texel: float) -> Floats:
    """Return points (3, H, W) on an ellipsoid, from +z down, and once around z from -x over -y."""
    reach = float(radii.max())
    turn = 2.0 * np.pi * (_middles(2.0 * np.pi * reach, texel) - 0.5)
    down = np.pi * _middles(np.pi * reach, texel)[:, None]
    across, height = np.sin(down), np.cos(down)
    ball = np.broadcast_arrays(across * np.cos(turn), across * np.sin(turn), height)
    return np.stack(ball) * radii[:, None, None]


def _wall(radius: float, half: float, texel: float) -> Floats:
    """Return points (3, H, W) on a tube's wall, from +z down, and once around z from -x over -y."""
    turn = 2.0 * np.pi * (_middles(2.0 * np.pi * radius, texel) - 0.5)
    height = half * (1.0 - 2.0 * _middles(2.0 * half, texel)[:, None])
    return np.stack(
        np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height)
    ).copy()


def _flat(half: Floats | tuple[float, float], texel: float) -> Floats:
    """Return points (3, H, W) on a rectangle, from -x to +x and from +y down."""
    x = half[0] * (2.0 * _middles(2.0 * half[0], texel) - 1.0)
    y = half[1] * (1.0 - 2.0 * _middles(2.0 * half[1], texel)[:, None])
    return np.stack(np.broadcast_arrays(x, y, 0.0)).copy()


def texture_of(colors: Floats | NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return linear colours (3, N) as a texture (H, W, 3)."""
    levels = np.rint(255.0 * np.clip(colors, 0.0, 1.0) ** (1.0 / GAMMA))
    return np.ascontiguousarray(levels.T.reshape(*shape, 3).astype(np.uint8))

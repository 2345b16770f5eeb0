"""The sample's object: a painted wooden bird that looks aside and lifts one wing."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.sim.samples.drawing.painting import texture_of
from servoid.sim.samples.drawing.patterns import GAMMA
from servoid.sim.samples.drawing.solids import (
    Array,
    RoundBox,
    RoundCone,
    RoundCylinder,
    Solid,
    Triple,
    blend,
    turned_axes,
)
from servoid.sim.samples.drawing.surface_nets import finer, surface_net
from servoid.sim.world.scene.visuals import OBJECT, Finish, MeshShape, Visual

BOUND_CENTER = (-0.008, 0.014, 0.102)
BOUND_RADIUS = 0.142

_SPACING, _FINER = 0.0024, 1  # metres from vertex to vertex, and how often that is halved
_GLOSS = 0.16
_PAINT_EDGE = 0.0004  # metres over which one paint gives way to the next


@dataclass(frozen=True)
class Part:
    """One painted solid; `blend_width` rounds the seam to the parts before it, in metres."""

    name: str
    solid: Solid
    paint: Triple  # sRGB, 0 to 1
    blend_width: float


_TEAL = (0.10, 0.50, 0.54)
_NAVY = (0.12, 0.20, 0.38)
_CORAL = (0.86, 0.30, 0.24)
_CREAM = (0.95, 0.90, 0.78)
_YELLOW = (0.95, 0.72, 0.20)
_ORANGE = (0.93, 0.47, 0.11)
_WOOD = (0.72, 0.54, 0.36)
_BLACK = (0.06, 0.06, 0.07)

_HEAD = np.array([0.046, 0.006, 0.150])
_GAZE = np.array([np.cos(0.60), np.sin(0.60), -0.06])


def _along_gaze(forward: float, left: float, up: float) -> Triple:
    """Return the point at an offset forward, left and up from the head's centre."""
    aside = np.array([-_GAZE[1], _GAZE[0], 0.0])
    x, y, z = _HEAD + forward * _GAZE + left * aside + np.array([0.0, 0.0, up])
    return float(x), float(y), float(z)


PARTS = (
    Part("body", RoundCone((0.012, 0, 0.080), (-0.058, 0, 0.090), 0.049, 0.024), _TEAL, 0.01),
    Part(
        "head", RoundCone((0.036, 0.003, 0.125), _along_gaze(0, 0, 0), 0.030, 0.034), _TEAL, 0.022
    ),
    Part(
        "beak",
        RoundCone(_along_gaze(0.024, 0, -0.002), _along_gaze(0.074, 0, -0.014), 0.0165, 0.0050),
        _ORANGE,
        0.004,
    ),
    Part(
        "crest",
        RoundCone(_along_gaze(-0.012, 0, 0.030), _along_gaze(-0.040, 0.004, 0.048), 0.0105, 0.0045),
        _CORAL,
        0.008,
    ),
    Part(
        "tail",
        RoundBox((-0.098, 0.0, 0.113), (0.040, 0.027, 0.0075), 0.007, turned_axes(0, -33, 0)),
        _CORAL,
        0.014,
    ),
    Part(
        "lifted wing",
        RoundBox((-0.022, 0.078, 0.118), (0.025, 0.046, 0.0070), 0.0065, turned_axes(12, -6, 42)),
        _YELLOW,
        0.014,
    ),
    Part(
        "folded wing",
        RoundBox((-0.026, -0.042, 0.087), (0.046, 0.0075, 0.024), 0.007, turned_axes(10, -12, -14)),
        _YELLOW,
        0.006,
    ),
    Part("peg", RoundCylinder((0.002, 0, 0.026), 0.0115, 0.02, 0.002), _WOOD, 0.006),
    Part("stand", RoundCylinder((0.002, 0, 0.008), 0.046, 0.008, 0.004), _WOOD, 0.006),
)


@cache
def visual() -> Visual:
    """Return the bird in its paint, as what an object carries."""
    vertices, faces = mesh(_SPACING, _FINER)
    count = len(vertices)
    colors = texture_of(paint(vertices.T.astype(np.float32)), (count, 1)).reshape(count, 3)
    return Visual(MeshShape(vertices, faces, colors=colors), Finish(gloss=_GLOSS), OBJECT)


def mesh(spacing: float, halved: int = 0) -> tuple[Floats, NDArray[np.int64]]:
    """Return vertices (N, 3) and faces (M, 3) of the surface, closed, anticlockwise from outside.

    Vertices are about `spacing` metres apart before that is halved so often.
    """

    def away(points: Floats) -> Floats:
        return distance(points.T.astype(np.float32)).astype(np.float64)

    center, reach = np.array(BOUND_CENTER), np.full(3, BOUND_RADIUS)
    vertices, faces = surface_net(away, center - reach, center + reach, spacing)
    for _ in range(halved):
        vertices, faces = finer(away, vertices, faces)
    return vertices, faces


def distance(points: Array) -> Array:
    """Return how far points (3, N) in metres are from the bird's surface, as (N,)."""
    first, *rest = PARTS
    total = first.solid.distance(points)
    for part in rest:
        total = blend(total, part.solid.distance(points), part.blend_width)
    return total


def paint(points: Array) -> Array:
    """Return the linear colours (3, N), 0 to 1, of points (3, N) on the bird's surface."""
    distances = np.stack([part.solid.distance(points) for part in PARTS])
    weights = np.exp((distances.min(axis=0) - distances) * np.float32(1 / _PAINT_EDGE))
    weights /= weights.sum(axis=0)
    colors = np.array([part.paint for part in PARTS], np.float32) ** np.float32(GAMMA)
    painted = np.zeros_like(points)
    for weight, color in zip(weights, colors, strict=True):
        painted += weight * color[:, None]
    painted = _coat(painted, _inside(points, (0.062, 0.010, 0.072), 0.047), _CREAM, weights[0])
    beak_tip = _inside(points, _along_gaze(0.084, 0, -0.016), 0.022)
    painted = _coat(painted, beak_tip, _BLACK, weights[2])
    for side in (-1.0, 1.0):
        eye = _along_gaze(0.0175, side * 0.0265, 0.0085)
        painted = _coat(painted, _inside(points, eye, 0.0115), _CREAM, weights[1])
        painted = _coat(painted, _inside(points, eye, 0.0072), _BLACK, weights[1])
    return painted


def _inside(points: Array, center: Triple, radius: float) -> Array:
    """Return 1 inside a ball and 0 outside, with a soft edge."""
    away: Array = np.sqrt(((points - np.asarray(center, np.float32)[:, None]) ** 2).sum(axis=0))
    cover: Array = (np.float32(radius) - away) * np.float32(1 / _PAINT_EDGE) + np.float32(0.5)
    return np.clip(cover, 0, 1).astype(np.float32, copy=False)


def _coat(painted: Array, cover: Array, color: Triple, weight: Array) -> Array:
    """Return the paint (3, N) after another coat where both `cover` and `weight` (N,) allow it."""
    share = cover * weight
    linear = np.asarray(color, np.float32)[:, None] ** np.float32(GAMMA)
    coated = painted + share * (linear - painted)
    return np.asarray(coated, np.float32)

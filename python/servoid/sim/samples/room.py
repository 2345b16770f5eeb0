"""The moving sample's surroundings: a table before a papered wall, with things on it.

The room's frame: x right, y away from the camera, z up; the table's top is at z = 0. The things
have the colours of the snail.
"""

from functools import lru_cache, partial

import numpy as np

from servoid.pose import Floats
from servoid.sim.samples import snail
from servoid.sim.samples.drawing import patterns
from servoid.sim.samples.drawing.convex import Convex, box, ellipsoid, tube
from servoid.sim.samples.drawing.painting import flat_painted, painted
from servoid.sim.world.scene.visuals import ROOM, Visual

_POSTERS = 5
_COLUMNS, _ROWS = 11, 2
_CARDS = 7
_TEXEL, _COARSE_TEXEL = 2e-3, 4e-3  # metres: of what stands about, and of table and wall
_COLORS = (
    snail.RED,
    snail.TEAL,
    snail.CREAM,
    snail.OCHRE,
    snail.KRAFT,
    snail.GREEN,
    snail.DARK,
    snail.WHITE,
)

TOWARD_LAMP = (-0.5345, -0.4811, 0.6949)
LEVEL = 0.92


@lru_cache(maxsize=4)
def furnish(seed: int) -> tuple[Visual, ...]:
    """Return the room; another seed gives other things."""
    random = np.random.default_rng([seed, 1])
    parts = []
    for index in range(_POSTERS):
        place = (-1.0 + 0.5 * index + random.uniform(-0.06, 0.06), 1.5, random.uniform(0.22, 0.42))
        parts.append(box(place, (random.uniform(0.13, 0.2), 0.01, random.uniform(0.12, 0.2))))
    for row in range(_ROWS):
        for column in range(_COLUMNS):
            x = 0.17 * (column - 0.5 * (_COLUMNS - 1) + 0.5 * row) + random.uniform(-0.03, 0.03)
            parts.append(_table_item(random, x, 0.94 + 0.24 * row + random.uniform(-0.04, 0.04)))
    for column in range(_CARDS):
        place = (
            0.16 * (column - 0.5 * (_CARDS - 1)) + random.uniform(-0.04, 0.04),
            random.uniform(0.52, 0.82),
            0.001,
        )
        half_size = (*random.uniform(0.03, 0.06, 2), 0.001)
        parts.append(box(place, half_size, (random.uniform(-60.0, 60.0), 0.0, 0.0)))
    seen = [_table(), _wall()]
    for part, choice in zip(parts, random.integers(0, 2**31, len(parts)), strict=True):
        paint = partial(_paint, part=part, seed=int(choice))
        seen += painted(part, paint, texel=_TEXEL, carrier=ROOM)
    return tuple(seen)


def _table() -> Visual:
    return flat_painted((0.0, 1.0, 0.0), (3.0, 1.0), np.eye(3), _wood, texel=_COARSE_TEXEL)


def _wall() -> Visual:
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    return flat_painted((0.0, 1.5, 0.7), (3.0, 1.6), upright, _wallpaper, texel=_COARSE_TEXEL)


def _table_item(random: np.random.Generator, x: float, y: float) -> Convex:
    """Return a thing on the table at (x, y)."""
    kind, yaw = random.integers(0, 4), random.uniform(-40.0, 40.0)
    if kind == 0:
        radius = random.uniform(0.035, 0.065)
        return ellipsoid((x, y, radius), (radius, radius, radius), (yaw, 30.0, 50.0))
    if kind == 1:
        half = random.uniform(0.05, 0.11)
        return tube((x, y, half), random.uniform(0.03, 0.05), half, (yaw, 0.0, 0.0))
    half_size = (*random.uniform((0.02, 0.03), (0.07, 0.06)), random.uniform(0.05, 0.13))
    return box((x, y, half_size[2]), half_size, (yaw, 0.0, 0.0))


def _paint(points: Floats, part: Convex, seed: int) -> Floats:
    """Return the linear colours (3, N) of points (3, N) on one of the room's solids."""
    random = np.random.default_rng(seed)
    picks = random.permutation(len(_COLORS))
    base, second, third = (_COLORS[pick] for pick in picks[:3])
    local = part.to_local(points)
    painted = patterns.plain(base, points.shape[1])
    lumps = patterns.rough_clouds(local, 0.03, seed) - random.uniform(0.5, 0.65)
    painted = patterns.coat(painted, patterns.covered(0.06 * lumps), second)
    flat = part.radii.min(axis=0)[2] < 0.01
    around, up = local[0] + 0.8 * local[1], local[2]
    if flat:
        around, up = local[0], local[1]
    low, high = np.sort(random.uniform(-0.06, 0.06, 2)) * (0.4 if flat else 1.0)
    band = patterns.covered(up - low) * patterns.covered(high - up)
    painted = patterns.coat(painted, band, third)
    ink = patterns.print_lines(around, -up, random.uniform(0.005, 0.009), seed)
    painted = patterns.coat(painted, band * ink, _COLORS[picks[3]])
    if random.random() < 0.4:
        lines = patterns.stripes(around + 0.5 * up, random.uniform(0.02, 0.04), 0.4)
        painted = patterns.coat(painted, lines * (1.0 - band), second)
    return patterns.mottle(painted, local, 0.025, 0.25, seed + 1)


def _wood(points: Floats) -> Floats:
    """Return planks: grain along x and dark joints."""
    grain = points * np.array([0.12, 1.0, 1.0])[:, None]
    painted = patterns.mottle(
        patterns.plain((0.60, 0.44, 0.30), points.shape[1]), grain, 0.012, 0.5, seed=31
    )
    return patterns.coat(painted, 0.7 * patterns.stripes(points[1], 0.11, 0.02), snail.DARK)


def _wallpaper(points: Floats) -> Floats:
    """Return pale paper with faded stripes and blotches."""
    painted = patterns.plain((0.72, 0.70, 0.62), points.shape[1])
    painted = patterns.coat(painted, 0.35 * patterns.stripes(points[0], 0.09), snail.TEAL)
    return patterns.mottle(painted, points, 0.06, 0.3, seed=33)

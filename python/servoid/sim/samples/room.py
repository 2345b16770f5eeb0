"""The moving sample's surroundings: a table before a papered wall, with things that stand on it.

The room's frame: x right, y away from the camera, z up; the table's top is at z = 0. What stands
about wears the colours of the snail.
"""

import numpy as np

from servoid.sim.samples import snail
from servoid.sim.samples.drawing import patterns
from servoid.sim.samples.drawing.convex import Convex, Floats, box, ellipsoid, tube
from servoid.sim.samples.drawing.layers import Drawable, Lamp

_TABLE, _WALL = 0, 1
_POSTERS = 5
_COLUMNS, _ROWS = 11, 2
_CARDS = 7
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

LAMP = Lamp(np.array([-0.5345, -0.4811, 0.6949]), np.array([0.0, 0.0, 1.0]))


def furnish(seed: int) -> Drawable:
    """Return the room; another seed stands other things about."""
    random = np.random.default_rng([seed, 1])
    parts = [
        box((0.0, 1.0, -0.25), (3.0, 1.0, 0.25)),
        box((0.0, 1.75, 0.7), (3.0, 0.25, 1.6)),
    ]
    for index in range(_POSTERS):
        place = (-1.0 + 0.5 * index + random.uniform(-0.06, 0.06), 1.5, random.uniform(0.22, 0.42))
        parts.append(box(place, (random.uniform(0.13, 0.2), 0.01, random.uniform(0.12, 0.2))))
    for row in range(_ROWS):
        for column in range(_COLUMNS):
            x = 0.17 * (column - 0.5 * (_COLUMNS - 1) + 0.5 * row) + random.uniform(-0.03, 0.03)
            parts.append(_stand(random, x, 0.94 + 0.24 * row + random.uniform(-0.04, 0.04)))
    for column in range(_CARDS):
        place = (
            0.16 * (column - 0.5 * (_CARDS - 1)) + random.uniform(-0.04, 0.04),
            random.uniform(0.52, 0.82),
            0.001,
        )
        half_size = (*random.uniform(0.03, 0.06, 2), 0.001)
        parts.append(box(place, half_size, (random.uniform(-60.0, 60.0), 0.0, 0.0)))
    choices = random.integers(0, 2**31, len(parts))

    def paint(points: Floats, part: int) -> Floats:
        return _paint(parts[part], part, points, int(choices[part]))

    return Drawable(parts, paint, backdrops=_WALL + 1)


def _stand(random: np.random.Generator, x: float, y: float) -> Convex:
    """Return something that stands on the table at (x, y)."""
    kind, yaw = random.integers(0, 4), random.uniform(-40.0, 40.0)
    if kind == 0:
        radius = random.uniform(0.035, 0.065)
        return ellipsoid((x, y, radius), (radius, radius, radius), (yaw, 30.0, 50.0))
    if kind == 1:
        half = random.uniform(0.05, 0.11)
        return tube((x, y, half), random.uniform(0.03, 0.05), half, (yaw, 0.0, 0.0))
    half_size = (*random.uniform((0.02, 0.03), (0.07, 0.06)), random.uniform(0.05, 0.13))
    return box((x, y, half_size[2]), half_size, (yaw, 0.0, 0.0))


def _paint(part: Convex, index: int, points: Floats, seed: int) -> Floats:
    """Return the linear colours (3, N) of points (3, N) on one of the room's solids."""
    if index == _TABLE:
        return _wood(points)
    if index == _WALL:
        return _wallpaper(points)
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
    """Return pale paper with faded stripes and lumps."""
    painted = patterns.plain((0.72, 0.70, 0.62), points.shape[1])
    painted = patterns.coat(painted, 0.35 * patterns.stripes(points[0], 0.09), snail.TEAL)
    return patterns.mottle(painted, points, 0.06, 0.3, seed=33)

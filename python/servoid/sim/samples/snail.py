"""The moving sample's object: a painted toy snail that carries a parcel, 0.2 m long.

Its frame is near its middle: x to its head, y to its left, z up.
"""

from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.sim.samples.drawing import patterns
from servoid.sim.samples.drawing.convex import Convex, box, ellipsoid, tube
from servoid.sim.samples.drawing.painting import painted
from servoid.sim.world.scene.visuals import OBJECT, Visual

RED = (0.80, 0.20, 0.16)
CREAM = (0.93, 0.87, 0.72)
TEAL = (0.12, 0.46, 0.50)
OCHRE = (0.87, 0.62, 0.20)
DARK = (0.12, 0.10, 0.12)
KRAFT = (0.70, 0.53, 0.36)
GREEN = (0.42, 0.58, 0.26)
WHITE = (0.96, 0.95, 0.92)

_SHELL, _PARCEL, _CHIMNEY = 1, 6, 7
_EYES = (4, 5)

PARTS: tuple[Convex, ...] = (
    ellipsoid((0.000, 0.000, -0.045), (0.092, 0.031, 0.022)),
    ellipsoid((-0.020, 0.004, 0.010), (0.056, 0.039, 0.055), (8.0, 0.0, 6.0)),
    ellipsoid((0.070, 0.002, -0.014), (0.021, 0.020, 0.040), (0.0, -24.0, 0.0)),
    ellipsoid((0.086, 0.006, 0.022), (0.025, 0.021, 0.019), (14.0, 10.0, 0.0)),
    ellipsoid((0.090, 0.022, 0.048), (0.0065, 0.0065, 0.024), (0.0, 8.0, -22.0)),
    ellipsoid((0.103, -0.008, 0.043), (0.0065, 0.0065, 0.021), (0.0, -38.0, 14.0)),
    box((-0.034, -0.050, 0.000), (0.030, 0.017, 0.024), (-8.0, 6.0, 4.0)),
    tube((-0.034, 0.016, 0.066), 0.012, 0.016, (0.0, 0.0, -12.0)),
)

PLAIN_PAINT = OCHRE

_GLOSS = 0.12
_TEXEL = 5e-4  # metres


@cache
def visuals(*, plain: bool) -> tuple[Visual, ...]:
    """Return the snail in its paint, or in one colour, as what an object carries."""
    worn = paint_plain if plain else paint
    seen: list[Visual] = []
    for index, part in enumerate(PARTS):
        texel = part.bound if plain else _TEXEL
        seen += painted(part, partial(worn, part=index), texel=texel, carrier=OBJECT, gloss=_GLOSS)
    return tuple(seen)


def paint(points: Floats, part: int) -> Floats:
    """Return the linear colours (3, N), 0 to 1, of points (3, N) on one part's surface."""
    local = PARTS[part].to_local(points)
    if part == _SHELL:
        return _shell(local)
    if part == _PARCEL:
        return _parcel(local)
    if part == _CHIMNEY:
        painted = patterns.plain(DARK, points.shape[1])
        return patterns.coat(painted, patterns.stripes(local[2], 0.011), CREAM)
    if part in _EYES:
        painted = patterns.plain(GREEN, points.shape[1])
        painted = patterns.coat(painted, patterns.covered(local[2] - 0.009), WHITE)
        return patterns.coat(painted, patterns.covered(local[2] - 0.0165), DARK)
    return _skin(points)


def paint_plain(points: Floats, part: int) -> Floats:
    """Return the linear colours (3, N) of a snail without any pattern."""
    del part
    return patterns.plain(PLAIN_PAINT, points.shape[1])


def _skin(points: Floats) -> Floats:
    """Return teal with ochre spots, a printed band along the foot and a smile."""
    painted = patterns.mottle(patterns.plain(TEAL, points.shape[1]), points, 0.014, 0.45, seed=3)
    spots = 0.01 * (patterns.clouds(points, 0.009, seed=5) - 0.66)
    painted = patterns.coat(painted, patterns.covered(spots), OCHRE)
    band = patterns.covered(0.0105 - np.abs(points[2] + 0.047)) * patterns.covered(
        0.058 - np.abs(points[0] + 0.006)
    )
    painted = patterns.coat(painted, band, CREAM)
    ink = patterns.print_lines(points[0] + np.sign(points[1]), points[2] + 0.0555, 0.0024, seed=7)
    painted = patterns.coat(painted, band * ink, DARK)
    mouth = np.hypot(points[0] - 0.112, points[2] - 0.0125) - 0.007
    return patterns.coat(painted, patterns.covered(0.0012 - np.abs(mouth)), DARK)


def _shell(local: Floats) -> Floats:
    """Return a red and cream spiral, different on each side, with dark lines and a patch."""
    side = np.where(local[1] > 0.0, 1.0, -1.0)
    turn = np.arctan2(local[2], local[0] + 0.006) / (2.0 * np.pi)
    away = np.hypot(local[0] + 0.006, local[2])
    winding = away + 0.021 * side * turn
    painted = patterns.plain(RED, local.shape[1])
    painted = patterns.coat(painted, patterns.stripes(winding, 0.021), CREAM)
    painted = patterns.coat(painted, patterns.stripes(winding + 0.005, 0.021, 0.1), DARK)
    rays = patterns.stripes(0.05 * turn * 11.0, 0.05, 0.3) * patterns.covered(away - 0.038)
    painted = patterns.coat(painted, rays, OCHRE)
    patch = patterns.covered(0.016 - np.hypot(local[0] - 0.014, local[2] - 0.012))
    patch = patch * (local[1] > 0.0)
    painted = patterns.coat(painted, patch, TEAL)
    ink = patterns.print_lines(local[0], -local[2], 0.0026, seed=21)
    painted = patterns.coat(painted, patch * ink, WHITE)
    return patterns.mottle(painted, local, 0.011, 0.30, seed=9)


def _parcel(local: Floats) -> Floats:
    """Return brown paper with a string, a printed label and a stamp."""
    painted = patterns.mottle(patterns.plain(KRAFT, local.shape[1]), local, 0.008, 0.35, seed=13)
    front: NDArray[np.bool_] = local[1] < -0.0165
    label = patterns.covered(0.0165 - np.abs(local[0] + 0.008))
    label = label * patterns.covered(0.013 - np.abs(local[2] + 0.004)) * front
    painted = patterns.coat(painted, label, WHITE)
    painted = patterns.coat(
        painted, label * patterns.print_lines(local[0], -local[2], 0.0021, seed=15), DARK
    )
    stamp = patterns.covered(0.0065 - np.abs(local[0] - 0.019))
    stamp = stamp * patterns.covered(0.0075 - np.abs(local[2] - 0.012)) * front
    painted = patterns.coat(painted, stamp, RED)
    across, along = np.abs(local[0] - 0.006), np.abs(local[2] - 0.004)
    string = patterns.covered(0.0013 - np.minimum(across, along)) * ~front
    return patterns.coat(painted, string, CREAM)

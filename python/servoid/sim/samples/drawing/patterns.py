"""Procedural patterns: clouds, stripes and prints, each a function of position.

All take points in metres and return shares from 0 to 1, with slightly soft edges.
"""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats

Color = tuple[float, float, float]  # sRGB, 0 to 1

# The curve of sRGB is close to this power, but would change the samples, whose images are recorded.
GAMMA = 2.2

_SIDE = 32
_LATTICE = np.random.default_rng(11).random(_SIDE**3)
_INK = np.random.default_rng(12).random((_SIDE, _SIDE)) < 0.62
_EDGE = 0.0007  # metres of the transition between two colours
_LETTER, _LINE = 4, 7  # cells per letter, and per line
_LETTER_HEIGHT = 5


def clouds(points: Floats, size: float, seed: int) -> Floats:
    """Return smooth noise (N,) at points (3, N), with a scale of about `size` metres."""
    places = points / size + np.random.default_rng(seed).uniform(0.0, _SIDE, (3, 1))
    low = np.floor(places)
    x, y, z = (part * part * (3.0 - 2.0 * part) for part in places - low)
    i, j, k = low.astype(np.int32) & (_SIDE - 1)
    further = (k + 1) & (_SIDE - 1)

    def along_z(a: NDArray[np.int32], b: NDArray[np.int32]) -> Floats:
        column = (((a & (_SIDE - 1)) * _SIDE) + (b & (_SIDE - 1))) * _SIDE
        near = _LATTICE.take(column + k)
        return near + z * (_LATTICE.take(column + further) - near)

    left, right = along_z(i, j), along_z(i + 1, j)
    left += y * (along_z(i, j + 1) - left)
    right += y * (along_z(i + 1, j + 1) - right)
    return left + x * (right - left)


def rough_clouds(points: Floats, size: float, seed: int) -> Floats:
    """Return noise (N,) at points (3, N) with scales of `size` metres and finer ones."""
    fine = clouds(points, 0.31 * size, seed + 2)
    return (
        0.55 * clouds(points, size, seed)
        + 0.3 * clouds(points, 0.52 * size, seed + 1)
        + (0.15 * fine)
    )


def covered(depth: Floats) -> Floats:
    """Return the coverage (N,) of a patch for distances in metres inside its edge."""
    return np.clip(depth / _EDGE + 0.5, 0.0, 1.0)


def stripes(along: Floats, period: float, share: float = 0.5) -> Floats:
    """Return stripes (N,) across a coordinate (N,) in metres; `share` of each period is painted."""
    away = np.abs((along / period) % 1.0 - 0.5) * period
    return covered(0.5 * share * period - away)


def print_lines(u: Floats, v: Floats, cell: float, seed: int) -> Floats:
    """Return lines of made-up letters (N,) at (u, v) (N,); a letter is 3 by 5 cells."""
    start = np.random.default_rng(seed).integers(0, _SIDE, 2)
    column, row = u / cell - 0.5, v / cell - 0.5
    i, j = np.floor(column), np.floor(row)
    # The edge is half-way between two cells; print is as sharp as other paint.
    sharp = max(cell / _EDGE, 1.0)
    right = np.clip((column - i - 0.5) * sharp + 0.5, 0.0, 1.0)
    down = np.clip((row - j - 0.5) * sharp + 0.5, 0.0, 1.0)
    i, j = i.astype(np.int64), j.astype(np.int64)

    def ink(a: NDArray[np.int64], b: NDArray[np.int64]) -> Floats:
        free = (a % _LETTER == _LETTER - 1) | (b % _LINE >= _LETTER_HEIGHT)
        found = _INK[(a + start[0]) & (_SIDE - 1), (b + start[1]) & (_SIDE - 1)]
        return np.asarray(found & ~free, np.float64)

    top = ink(i, j) + right * (ink(i + 1, j) - ink(i, j))
    bottom = ink(i, j + 1) + right * (ink(i + 1, j + 1) - ink(i, j + 1))
    return np.asarray(top + down * (bottom - top))


def plain(color: Color, count: int) -> Floats:
    """Return linear colours (3, N) of `count` points, all of one paint."""
    return np.repeat(_linear(color), count, axis=1)


def coat(painted: Floats, cover: Floats, color: Color) -> Floats:
    """Return linear colours (3, N) with another coat, blended by `cover` (N,)."""
    return painted + cover * (_linear(color) - painted)


def mottle(painted: Floats, points: Floats, size: float, strength: float, seed: int) -> Floats:
    """Return linear colours (3, N) with lighter and darker blotches."""
    shade = 1.0 + 2.0 * strength * (rough_clouds(points, size, seed) - 0.5)
    return np.clip(painted * shade, 0.0, 1.0)


def _linear(color: Color) -> Floats:
    return np.array(color)[:, None] ** GAMMA

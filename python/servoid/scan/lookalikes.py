"""Finds images that are placed side by side, but do not see the same points there.

Sides of an object that look alike, such as the front and the back of a box, match as one side, and
images of both get the same poses. The surroundings of the two do not match.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.scan.solution import Solution

_NEAR = 0.2  # of the distance to the points: positions between which little gets hidden
_NEAR_RAD = math.radians(12.0)
_CELLS = 8  # along the longer side of an image
_FEW_POINTS = 4  # in a cell: of fewer, none may be shared by chance
_LEAST_POINTS = 30  # in the cells that are compared
_LEAST_CELLS = 2
_UNSHARED = 0.15  # share of the points; at most 0.05 in 400 right pairs, 0.20 to 0.62 in wrong ones
_LEAST_PAIRS = 2


@dataclass(frozen=True)
class Lookalike:
    """Two images, and the largest share of the points of one that are unknown to the other."""

    names: tuple[str, str]
    share: float


def lookalikes(solution: Solution) -> tuple[Lookalike, ...]:
    """Return the pairs of images that contradict their being side by side, the surest first.

    A single pair is none: something may have moved in one image.
    """
    found = []
    for one, other in _side_by_side(solution):
        share = max(_unshared(solution, one, other), _unshared(solution, other, one))
        if share > _UNSHARED:
            found.append(Lookalike((solution.names[one], solution.names[other]), share))
    found.sort(key=lambda pair: -pair.share)
    return tuple(found) if len(found) >= _LEAST_PAIRS else ()


def _side_by_side(solution: Solution) -> list[tuple[int, int]]:
    """Return the pairs of images that have nearly the same pose, by their indices."""
    poses, places = solution.world_from_camera, solution.places
    pairs = []
    for one, pose in enumerate(poses):
        ways = np.sqrt(((places[one + 1 :] - places[one]) ** 2).sum(axis=1))
        for ahead in np.flatnonzero(ways < _NEAR * solution.distance):
            other = one + 1 + int(ahead)
            turn = (pose.inverse() @ poses[other]).log()[3:]
            if math.sqrt(sum(float(part) ** 2 for part in turn)) < _NEAR_RAD:
                pairs.append((one, other))
    return pairs


def _unshared(solution: Solution, one: int, other: int) -> float:
    """Return the share of the points of one image that lie where the other sees only others.

    Points are compared by cells of the other image in which each has several: features that were
    missed are spread, but what the other does not see at all fills cells.
    """
    rows = solution.seen[one]
    other_from_world = solution.world_from_camera[other].inverse()
    pixels = solution.lens.project(other_from_world.transform(solution.points[rows]))
    expected, count = _cells(pixels, solution.lens.size_px)
    there, _ = _cells(solution.marks_px[other], solution.lens.size_px)
    shared = np.isin(rows, solution.seen[other]) & (expected >= 0)
    wanted = np.bincount(expected[expected >= 0], minlength=count)
    compared = (wanted >= _FEW_POINTS) & (
        np.bincount(there[there >= 0], minlength=count) >= _FEW_POINTS
    )
    foreign = compared & (np.bincount(expected[shared], minlength=count) == 0)
    total = int(wanted[compared].sum())
    if total < _LEAST_POINTS or int(foreign.sum()) < _LEAST_CELLS:
        return 0.0
    return int(wanted[foreign].sum()) / total


def _cells(pixels: Floats, size_px: tuple[int, int]) -> tuple[NDArray[np.int64], int]:
    """Return the cell of each of the pixels (N, 2), -1 outside of the image, and their number."""
    width, height = size_px
    side = max(size_px) / _CELLS
    columns, rows = math.ceil(width / side), math.ceil(height / side)
    inside = ((pixels >= 0.0) & (pixels < np.array([width, height]))).all(axis=1)
    cells = np.full(len(pixels), -1, np.int64)
    column, row = (pixels[inside] // side).astype(np.int64).T
    cells[inside] = column + columns * row
    return cells, columns * rows

"""Nearest neighbours of points: how dense they are, and where their surface faces."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import exact
from servoid.words import counted, measured

_AT_ONCE = 1 << 21  # squared distances that are computed together
_MOST, _FAR = 0.9, 3.0  # of the points, and how many times as far from the middle strays are
_NEIGHBOURS, _ALONE = 4, 5.0  # strays are as many times farther from their neighbours than usual
_QUERIES = 400


def nearest(
    points: NDArray[np.float64], queries: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the nearest other points of some points, nearest first, and their distances.

    `points` is (N, 2) or (N, 3), `queries` (Q,) are indices of points; both results are (Q, count).
    """
    step = max(1, _AT_ONCE // len(points))
    found, ways = [], []
    for first in range(0, len(queries), step):
        chosen = queries[first : first + step]
        squared = sum(
            np.square(points[chosen, axis, None] - points[None, :, axis])
            for axis in range(points.shape[1])
        )
        squared = np.asarray(squared)
        squared[np.arange(len(chosen)), chosen] = np.inf
        index = np.stack([_least(row, count) for row in squared])
        found.append(index)
        ways.append(np.sqrt(np.take_along_axis(squared, index, axis=1)))
    return np.concatenate(found), np.concatenate(ways)


def _least(values: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Return where the least of some values are, in their order, the first of equal ones first."""
    near = np.arange(len(values))
    if count < len(values):
        near = np.flatnonzero(values <= np.partition(values, count - 1)[count - 1])
    return near[np.argsort(values[near], kind="stable")][:count].astype(np.int64)


def some_of(count: int, most: int) -> NDArray[np.int64]:
    """Return at most `most` indices below `count`, evenly spread."""
    return np.arange(0, count, -(-count // most) or 1, dtype=np.int64)


def surface_normals(
    points: NDArray[np.float64], neighbours: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the normals of the planes through neighbours, (Q, K) indices, as (Q, 3) unit vectors.

    Their signs are arbitrary.
    """
    normals = np.empty((len(neighbours), 3))
    for row, near in enumerate(neighbours):
        offsets = points[near] - points[near].mean(axis=0)
        _, axes = exact.eigh(exact.product(np.ascontiguousarray(offsets.T), offsets))
        normals[row] = axes[:, 0]
    return normals


def stray_points(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of some points, (N, 3), lie apart, (N,): far from the others and each alone."""
    away = exact.lengths(points - np.median(points, axis=0))
    far = np.flatnonzero(away > _FAR * float(np.quantile(away, _MOST)))
    strays = np.zeros(len(points), np.bool_)
    if len(far) and len(points) > _NEIGHBOURS:
        _, usual = nearest(points, some_of(len(points), _QUERIES), _NEIGHBOURS)
        _, ways = nearest(points, far.astype(np.int64), _NEIGHBOURS)
        strays[far] = ways[:, -1] > _ALONE * float(np.median(usual[:, -1]))
    return strays


def stray_note(points: NDArray[np.float64], one: str, more: str) -> str | None:
    """Report the points of some, (N, 3), that lie apart, and where; None if there are none."""
    strays = stray_points(points)
    count = int(strays.sum())
    if not count:
        return None
    lie = "lies" if count == 1 else "lie"
    middle = np.median(points[~strays], axis=0)
    away = exact.lengths(points[strays] - middle)
    farthest = ", ".join(measured(x) for x in points[strays][int(np.argmax(away))])
    upto = "" if count == 1 else "up to "
    return (
        f"{count} of {counted(len(points), one, more)} {lie} apart from the others, {upto}"
        f"{measured(float(away.max()))} m away{'' if count == 1 else ', the farthest'} at "
        f"({farthest})"
    )

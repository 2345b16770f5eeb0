"""Estimates by how many images one camera is behind another, from features that move.

A feature in the second image lies on the epipolar line of its place in the first. If the second
camera is behind by a lag, in images, it lies on the line of where the feature was before in the
first: it is off the line by the lag times the speed at which the line passes it. A wrong pose or
lens puts features off their lines too, but by where they are, not by how they move.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from servoid.pose import Floats, exact

_NOISE = 0.5  # thousandths of the diagonal: of how far a feature is off
_UNEVEN = 0.15  # share of the speed, as no motion is even
_ROUNDS = 12  # of weights
_TINY = 1e-3  # of the matrix, keeps what is undetermined at zero
_MOVES = 0.6  # thousandths of the diagonal an image: what moves less says little


@dataclass(frozen=True, eq=False)
class MovingFeatures:
    """Features of one instant, in thousandths of the diagonal of the second camera's image.

    `off` (N,) is how far they are off their epipolar lines, `speeds` (N,) how fast these pass in
    one image, and `places` (N, 3) where they are and how much nearer than the horizon.
    """

    off: Floats
    speeds: Floats
    places: Floats

    @property
    def moving(self) -> int:
        """Return the number of those that move across the lines."""
        return int((np.abs(self.speeds) > _MOVES).sum())


@dataclass(frozen=True)
class Lag:
    """By how many images the second of two cameras is behind the first.

    `error` is the standard error of `images`, and `extremes` are the least and the most that are
    left if any one instant is left out. `moving` features at `instants` determine it.
    """

    images: float
    error: float
    extremes: tuple[float, float]
    moving: int
    instants: int

    @property
    def least(self) -> float:
        """Return the smallest lag, without its sign, that is left; 0 if signs differ."""
        low, high = self.extremes
        return max(low, -high, 0.0)

    def shifted(self, images: int) -> "Lag":
        """Return the lag if the first camera was shifted by whole images."""
        low, high = self.extremes
        return replace(self, images=self.images + images, extremes=(low + images, high + images))


def fit_lag(seen: Sequence[MovingFeatures]) -> Lag:
    """Estimate the lag from two or more instants.

    The standard error is that of leaving out whole instants, as errors of one have common causes.
    """
    columns = [np.column_stack([one.speeds, np.ones(len(one.off)), one.places]) for one in seen]
    noises = [_NOISE + _UNEVEN * np.abs(one.speeds) for one in seen]
    found = np.zeros(columns[0].shape[1])
    sums = _sums(seen, columns, [1.0 / np.square(noise) for noise in noises])
    for _ in range(_ROUNDS):
        found = _solved(sums)
        weights = []
        for one, terms, noise in zip(seen, columns, noises, strict=True):
            left = np.abs(one.off - exact.product(terms, found))
            weights.append(1.0 / (noise * np.maximum(noise, left)))  # Huber's
        sums = _sums(seen, columns, weights)
    without = np.array(
        [_solved([*sums[:place], *sums[place + 1 :]])[0] for place in range(len(seen))]
    )
    count = len(seen)
    spread = np.square(without - without.mean()).sum() * (count - 1) / count
    extremes = float(without.min()), float(without.max())
    moving = [one.moving for one in seen]
    return Lag(
        float(found[0]),
        float(np.sqrt(spread)),
        extremes,
        sum(moving),
        sum(one > 0 for one in moving),
    )


def _sums(
    seen: Sequence[MovingFeatures], columns: Sequence[Floats], weights: Sequence[Floats]
) -> list[tuple[Floats, Floats]]:
    """Return the normal equations of each instant."""
    sums = []
    for one, terms, weight in zip(seen, columns, weights, strict=True):
        weighted = np.ascontiguousarray((terms * weight[:, None]).T)
        sums.append((exact.product(weighted, terms), exact.product(weighted, one.off)))
    return sums


def _solved(sums: Sequence[tuple[Floats, Floats]]) -> Floats:
    matrix = np.sum([one for one, _ in sums], axis=0)
    right = np.sum([other for _, other in sums], axis=0)
    return exact.solve(matrix + _TINY * np.eye(len(right)), right)

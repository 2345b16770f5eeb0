"""Means over seeds, and how far they can be trusted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_RESAMPLES = 4000
_TAIL = 0.025


@dataclass(frozen=True)
class Interval:
    """A mean with its 95 % interval by the percentile bootstrap."""

    mean: float
    low: float
    high: float
    count: int

    def written(self, scale: float = 1.0, digits: int = 1) -> str:
        """Write it as `2.1 (1.8 to 2.5)`, scaled."""
        mean, low, high = (f"{scale * x:.{digits}f}" for x in (self.mean, self.low, self.high))
        return mean if self.count < 2 else f"{mean} ({low} to {high})"


def mean_interval(values: Sequence[float]) -> Interval | None:
    """Return the mean of values with its interval, the same each time; None if there are none."""
    return interval_of(values) if values else None


def interval_of(values: Sequence[float]) -> Interval:
    """Return the mean of one value or more with its interval, the same each time."""
    numbers = np.asarray(values, float)
    picks = np.random.default_rng(0).integers(0, len(numbers), (_RESAMPLES, len(numbers)))
    low, high = np.quantile(numbers[picks].mean(axis=1), [_TAIL, 1.0 - _TAIL])
    return Interval(float(numbers.mean()), float(low), float(high), len(numbers))

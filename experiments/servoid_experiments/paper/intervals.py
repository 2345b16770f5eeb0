"""Means over seeds, and how far they can be trusted."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom.
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
_NORMAL = 1.95996


@dataclass(frozen=True)
class Interval:
    """A mean over seeds, and the half width of its 95 % interval; None with a single seed."""

    mean: float
    half: float | None

    @property
    def low(self) -> float:
        """Return the lower end, the mean itself with a single seed."""
        return self.mean - (self.half or 0.0)

    @property
    def high(self) -> float:
        """Return the upper end, the mean itself with a single seed."""
        return self.mean + (self.half or 0.0)

    def written(self, digits: int, unit: str = "") -> str:
        """Say it, such as `9.8 ± 0.1 mm`."""
        half = "" if self.half is None else f" ± {self.half:.{digits}f}"
        return f"{self.mean:.{digits}f}{half}{unit}"

    def mm(self, digits: int = 1) -> str:
        """Say a length in millimetres, without the unit."""
        half = None if self.half is None else 1e3 * self.half
        return Interval(1e3 * self.mean, half).written(digits)


def interval(values: Sequence[float]) -> Interval:
    """Return the mean of independent values, at least one, and its interval by Student's t."""
    count = len(values)
    mean = float(np.mean(values))
    if count < 2:
        return Interval(mean, None)
    return Interval(mean, _quantile(count - 1) * float(np.std(values, ddof=1)) / math.sqrt(count))


def mean_interval(values: Sequence[float]) -> Interval | None:
    """Return the mean of values with its interval; None if there are none."""
    return interval(values) if values else None


def _quantile(freedom: int) -> float:
    """Return Student's quantile at 97.5 %: a table, then Cornish's and Fisher's expansion."""
    if freedom <= len(_STUDENT):
        return _STUDENT[freedom - 1]
    z = _NORMAL
    first = (z**3 + z) / (4.0 * freedom)
    return z + first + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * freedom**2)

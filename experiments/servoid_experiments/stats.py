"""Statistics over several seeds, as used by all studies."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

_SURE = 0.975  # both tails leave 95 %


@dataclass(frozen=True)
class Spread:
    """Mean, median and extremes of one or more values, one per seed.

    `half` is the half width of the mean's 95 % interval by Student's t, None for a single value. A
    value beyond all that was tried counts as inf.
    """

    count: int
    mean: float
    half: float | None
    middle: float
    low: float
    high: float

    @property
    def reach(self) -> float:
        """Return how far a single further value is from the mean in 95 % of cases."""
        return (self.half or 0.0) * math.sqrt(self.count + 1.0)


def spread_of(values: Iterable[float | None]) -> Spread | None:
    """Return the statistics of the known values, None if there are none."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    extremes = (float(np.median(known)), float(min(known)), float(max(known)))
    if math.inf in known:
        return Spread(len(known), math.inf, None, *extremes)
    return Spread(len(known), float(np.mean(known)), _half(known), *extremes)


def over(values: Iterable[float]) -> Spread:
    """Return the statistics of one or more values."""
    found = spread_of(values)
    assert found is not None, "no values"
    return found


def interval_headings(names: Iterable[str]) -> list[str]:
    """Return the headings of means and of the half widths of their intervals."""
    return [heading for name in names for heading in (name, f"{name}_95_half_width")]


def interval_cells(spreads: Iterable[Spread]) -> list[float | None]:
    """Return means and the half widths of their intervals."""
    return [cell for one in spreads for cell in (one.mean, one.half)]


def _half(values: Sequence[float]) -> float | None:
    """Return the half width of the 95 % interval of the mean."""
    if len(values) < 2:
        return None
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values))
    return _student(len(values) - 1) * error


@cache
def _student(freedoms: int) -> float:
    """Return how many standard errors the interval reaches, by Student's distribution."""
    from scipy import stats

    return float(stats.t.ppf(_SURE, freedoms))

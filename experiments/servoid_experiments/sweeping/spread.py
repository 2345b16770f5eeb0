"""How values that differ by their seed alone are spread."""

from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median


@dataclass(frozen=True)
class Spread:
    """The lowest, the middle and the highest of several values."""

    low: float
    middle: float
    high: float

    def text(self, digits: int, factor: float = 1.0) -> str:
        """Write the middle, and low and high where they differ from it, times a factor."""
        parts = [f"{factor * value:.{digits}f}" for value in (self.middle, self.low, self.high)]
        return parts[0] if len(set(parts)) == 1 else f"{parts[0]} ({parts[1]} to {parts[2]})"


def spread_of(values: Iterable[float | None]) -> Spread | None:
    """Return how the values that are known are spread, None if there are none."""
    known = [value for value in values if value is not None]
    return Spread(min(known), median(known), max(known)) if known else None


def confidence(count: int) -> float:
    """Return how likely the median of all seeds lies between the extremes of so many of them.

    It lies outside only if all values fall on one side of it, whatever their distribution.
    """
    return max(0.0, 1.0 - 0.5 ** (count - 1))

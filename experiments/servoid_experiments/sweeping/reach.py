"""What a curve says in words: where it is worst, and how far from the centre it holds."""

from collections.abc import Callable, Sequence

from servoid_experiments.sweeping.factor import Value
from servoid_experiments.sweeping.panels import Curve

Known = tuple[Value, float]


def known(curve: Curve) -> list[Known]:
    """Return the values at which something is known, with the middle of the seeds."""
    pairs = zip(curve.values, curve.spreads, strict=True)
    return [(value, spread.middle) for value, spread in pairs if spread is not None]


def lowest(curve: Curve) -> Known | None:
    """Return where a curve is lowest, None if nothing is known."""
    return min(known(curve), key=lambda pair: pair[1], default=None)


def highest(curve: Curve) -> Known | None:
    """Return where a curve is highest, None if nothing is known."""
    return max(known(curve), key=lambda pair: pair[1], default=None)


def at(curve: Curve, value: Value) -> float | None:
    """Return the middle of the seeds at a value, None if it is not known."""
    return dict(known(curve)).get(value)


def holding(curve: Curve, center: Value, holds: Callable[[float], bool]) -> list[Value]:
    """Return the values next to the centre, itself among them, up to which a figure holds.

    Of values that are no numbers, all at which it holds.
    """
    return beside(known(curve), center, holds)


def beside(pairs: Sequence[Known], center: Value, holds: Callable[[float], bool]) -> list[Value]:
    """Return the values next to the centre up to which a figure holds, as `holding` does."""
    if not all(isinstance(value, float | int) for value, _ in pairs):
        return [value for value, figure in pairs if holds(figure)]
    places = [place for place, (value, _) in enumerate(pairs) if value == center]
    if not places or not holds(pairs[places[0]][1]):
        return []
    first = last = places[0]
    while first > 0 and holds(pairs[first - 1][1]):
        first -= 1
    while last + 1 < len(pairs) and holds(pairs[last + 1][1]):
        last += 1
    return [value for value, _ in pairs[first : last + 1]]

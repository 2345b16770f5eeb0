"""Sweeps: one factor is varied at a time, around a case in the centre, over several seeds.

Factors, the cases that result from them, checks of settings, and the results as curves.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

import msgspec

from servoid.batch import Done
from servoid.errors import StudyError
from servoid.words import alternatives
from servoid_experiments.stats import Spread, spread_of

CaseT = TypeVar("CaseT", bound=msgspec.Struct)
RowT = TypeVar("RowT", bound=msgspec.Struct)

Value = float | int | str | Enum


@dataclass(frozen=True)
class Factor:
    """One quantity that is varied while all others stay at the centre.

    `key` names the field of a case, dotted if it is in a struct of the case. `log` requests a
    logarithmic axis; values that are not numbers are drawn side by side.
    """

    key: str
    title: str
    unit: str
    values: tuple[Value, ...]
    log: bool = False

    def at(self, case: msgspec.Struct) -> Value:
        """Return a case's value of the factor."""
        found: msgspec.Struct | Value = case
        for name in self.key.split("."):
            found = getattr(found, name)
        assert not isinstance(found, msgspec.Struct)
        return found

    def values_with(self, center: Value) -> tuple[Value, ...]:
        """Return the centre's value and the others, numbers in ascending order."""
        return _in_order((center, *self.values))


def _in_order(values: Iterable[Value]) -> tuple[Value, ...]:
    """Return values without duplicates, numbers in ascending order."""
    every = list(dict.fromkeys(values))
    numbers = [value for value in every if isinstance(value, float | int)]
    return tuple(sorted(numbers)) if len(numbers) == len(every) else tuple(every)


def varied(case: CaseT, key: str, value: Value) -> CaseT:
    """Return a case in which the field with a dotted name has another value."""
    name, _, rest = key.partition(".")
    inner = varied(getattr(case, name), rest, value) if rest else value
    return msgspec.structs.replace(case, **{name: inner})


def check_varied(sweep: msgspec.Struct) -> None:
    """Check that some factor has values to try.

    Raises:
        StudyError: none has; msgspec adds the position in the file.

    """
    names = [field.name for field in msgspec.structs.fields(sweep)]
    if not any(getattr(sweep, name) for name in names):
        raise StudyError(f"nothing is varied; give values to one of {', '.join(names)}")


def check_names(given: Iterable[str], known: Iterable[str], kind: str = "object") -> None:
    """Check that objects, or things of another kind, exist.

    Raises:
        StudyError: one does not; msgspec adds the position in the file.

    """
    every = list(known)
    for name in given:
        if name not in every:
            raise StudyError(f"unknown {kind} '{name}'{alternatives(name, every)}")


@dataclass(frozen=True)
class Curve:
    """A series: its spread at each value; None where unknown."""

    name: str
    color: str
    style: str
    values: tuple[Value, ...]
    spreads: tuple[Spread | None, ...]


@dataclass(frozen=True)
class Panel:
    """The curves of one factor, and the values that it has in the centres.

    `note` explains the dashed curves.
    """

    factor: Factor
    centers: tuple[Value, ...]
    curves: tuple[Curve, ...]
    note: str = ""

    @property
    def values(self) -> tuple[Value, ...]:
        """Return all values on the axis, numbers in their order."""
        return _in_order(value for curve in self.curves for value in curve.values)

    @property
    def has_names(self) -> bool:
        """Return whether the values are names."""
        return not all(isinstance(value, float | int) for value in self.values)


@dataclass(frozen=True)
class Series(Generic[CaseT]):
    """Cases in the centre that differ only in what is averaged over, such as the seed.

    `factors` are varied in it. A series with the style `--` is drawn beside others, and `note`
    explains it.
    """

    name: str
    color: str
    centers: tuple[CaseT, ...]
    factors: tuple[Factor, ...]
    style: str = "-"
    note: str = ""

    def cases(self) -> list[CaseT]:
        """Return each centre and its variations, one factor at a time, without duplicates."""
        found: dict[CaseT, None] = {}
        for center in self.centers:
            found[center] = None
            for factor in self.factors:
                for value in factor.values:
                    found[varied(center, factor.key, value)] = None
        return list(found)

    def values(self, factor: Factor) -> tuple[Value, ...]:
        """Return the values of a factor and that of the centre, in order."""
        return factor.values_with(factor.at(self.centers[0]))


class Sweep(Generic[CaseT, RowT]):
    """The rows of all trials that were run, indexed by their cases."""

    def __init__(self, trials: Sequence[Done]) -> None:
        self.rows: dict[CaseT, RowT] = {
            done.case: done.row for done in trials if done.row is not None
        }

    def spread(
        self,
        series: Series[CaseT],
        at: tuple[Factor, Value],
        metric: Callable[[RowT], float | None],
    ) -> Spread | None:
        """Return the statistics of a figure over the seeds that were run, with a factor at a value.

        It is None if no seed gave one.
        """
        factor, value = at
        cases = [varied(center, factor.key, value) for center in series.centers]
        return spread_of(metric(self.rows[case]) for case in cases if case in self.rows)

    def curve(
        self, series: Series[CaseT], factor: Factor, metric: Callable[[RowT], float | None]
    ) -> Curve:
        """Return a figure over the values of a factor."""
        values = series.values(factor)
        spreads = tuple(self.spread(series, (factor, value), metric) for value in values)
        return Curve(series.name, series.color, series.style, values, spreads)

    def panel(
        self,
        series: Sequence[Series[CaseT]],
        factor: Factor,
        metric: Callable[[RowT], float | None],
    ) -> Panel:
        """Return the curves of the series in which a factor is varied, dashed ones last."""
        found = [one for one in series if factor in one.factors]
        found.sort(key=lambda one: one.style != "-")
        curves = tuple(self.curve(one, factor, metric) for one in found)
        centers = dict.fromkeys(factor.at(one.centers[0]) for one in found if one.style == "-")
        return Panel(factor, tuple(centers), curves, next((x.note for x in found if x.note), ""))

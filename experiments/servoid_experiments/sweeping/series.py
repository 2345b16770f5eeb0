"""Curves of a sweep: the results of a series of cases over the values of a factor."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import msgspec

from servoid_experiments.design import Done
from servoid_experiments.stats import Spread, spread_of
from servoid_experiments.sweeping.factor import Factor, Value, varied
from servoid_experiments.sweeping.panels import Curve, Panel

CaseT = TypeVar("CaseT", bound=msgspec.Struct)
RowT = TypeVar("RowT", bound=msgspec.Struct)


@dataclass(frozen=True)
class Series(Generic[CaseT]):
    """Cases in the centre that differ only in what is averaged over, such as the seed."""

    name: str
    color: str
    centers: tuple[CaseT, ...]
    style: str = "-"

    def values(self, factor: Factor) -> tuple[Value, ...]:
        """Return the values of a factor and that of the centre, in order."""
        return factor.values_with(self.center(factor))

    def center(self, factor: Factor) -> Value:
        """Return a factor's value in the centre."""
        return factor.at(self.centers[0])


class Sweep(Generic[CaseT, RowT]):
    """The rows of all trials that were run, indexed by their cases."""

    def __init__(self, trials: Sequence[Done]) -> None:
        self._rows: Mapping[CaseT, RowT] = {
            done.case: done.row for done in trials if done.row is not None
        }

    @property
    def is_empty(self) -> bool:
        """Return whether no trial succeeded."""
        return not self._rows

    def rows(self, series: Series[CaseT], factor: Factor, value: Value) -> list[RowT]:
        """Return the results of a series with a factor at a value, for each seed that was run."""
        cases = [varied(center, factor.key, value) for center in series.centers]
        return [self._rows[case] for case in cases if case in self._rows]

    def spread(
        self,
        series: Series[CaseT],
        at: tuple[Factor, Value],
        metric: Callable[[RowT], float | None],
    ) -> Spread | None:
        """Return the statistics of a figure over the seeds, with a factor at a value."""
        return spread_of(metric(row) for row in self.rows(series, *at))

    def curve(
        self,
        series: Series[CaseT],
        factor: Factor,
        metric: Callable[[RowT], float | None],
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
        *,
        more: Sequence[Curve] = (),
        note: str = "",
    ) -> Panel:
        """Return the curves of several series over a factor, and `more`, which `note` names."""
        curves = tuple(self.curve(one, factor, metric) for one in series)
        centers = tuple(dict.fromkeys(one.center(factor) for one in series))
        return Panel(factor, centers, (*curves, *more), note)

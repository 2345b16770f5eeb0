"""Reads figures off the rows of servo runs, for tables and sentences."""

import math
from collections.abc import Callable, Sequence

from servoid_experiments.design import Done, Results
from servoid_experiments.findings import Table
from servoid_experiments.paper.intervals import Interval, interval
from servoid_experiments.paper.servoing_followed import Followed
from servoid_experiments.paper.servoing_settings import Constants, constants
from servoid_experiments.paper.servoing_trial import SERVOING, ServoingRow

_HEADINGS = (
    "run",
    "runs",
    "hand: amplitude",
    "hand: lag",
    "recognition: amplitude",
    "recognition: lag",
    "recognition: spread of x, y, z",
    "recognition: offset of z",
    "hand: RMS error in x, y, z",
    "poses scored an image",
)


def rows_of(results: Results, name: str) -> list[ServoingRow]:
    """Return the rows of the runs of a name that did not fail."""
    done = results.get(SERVOING.name, ())
    return [one.row for one in done if one.case.name == name and one.row is not None]


def failures(done: Sequence[Done]) -> tuple[str, ...]:
    """Say how many runs failed and why the first did; nothing if none failed."""
    failed = [one for one in done if one.row is None]
    if not failed:
        return ()
    return (f"{len(failed)} of {len(done)} runs failed and are left out: {failed[0].failure}.",)


def over(rows: Sequence[ServoingRow], take: Callable[[Followed], float]) -> Interval:
    """Return the mean of a figure over runs."""
    return interval([take(row.followed) for row in rows])


def period(omega: float) -> str:
    """Say the period of a motion, such as `T = 10 s`; `omega` is in rad/s."""
    return f"T = {2.0 * math.pi / omega:.2g} s"


def constants_table(given: Constants) -> Table:
    """Return each constant of the paper's servoing with its meaning and its source."""
    return Table(
        ("constant", "value", "meaning", "source"),
        constants(given),
        "All constants of the paper's servoing, and where each is from.",
    )


def response_table(results: Results, names: Sequence[str], caption: str) -> Table:
    """Return amplitude ratios, lags, spreads and errors of the runs of some names."""
    rows = [_cells(name, rows_of(results, name)) for name in names]
    return Table(_HEADINGS, rows, caption)


def _cells(name: str, rows: Sequence[ServoingRow]) -> tuple[str, ...]:
    def thrice(take: Callable[[Followed], Sequence[float]]) -> str:
        means = [over(rows, lambda row, axis=axis: 1e3 * take(row)[axis]).mean for axis in range(3)]
        return ", ".join(f"{mean:.2f}" for mean in means) + " mm"

    return (
        name,
        str(len(rows)),
        over(rows, lambda row: row.hand_gain).written(3),
        over(rows, lambda row: row.hand_lag_deg).written(2, " deg"),
        over(rows, lambda row: row.seen_gain).written(4),
        over(rows, lambda row: row.seen_lag_deg).written(2, " deg"),
        thrice(lambda row: row.seen_spread),
        over(rows, lambda row: 1e3 * row.seen_bias[2]).written(2, " mm"),
        thrice(lambda row: row.hand_rms),
        f"{interval([row.scored for row in rows]).mean:.0f}",
    )

"""Which assumed constants matter: a table by effect, and a tornado plot."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from servoid_experiments.design import Done, Results
from servoid_experiments.findings import Finding, Section, Table, Verdict
from servoid_experiments.paper.intervals import Interval, interval
from servoid_experiments.paper.sensitivity import BASE, SENSITIVITY, SensitivitySettings, changes
from servoid_experiments.paper.sensitivity_plot import Effect, draw_tornado
from servoid_experiments.paper.servoing_rows import constants_table, failures, period
from servoid_experiments.paper.servoing_settings import Constants, constants
from servoid_experiments.paper.servoing_trial import ServoingRow

_MOSTLY = 0.9  # share of the runs in which a finding holds for the most part
_UNITS = ("s", "hz", "px", "deg")

Take = Callable[[ServoingRow], float]

LAG = "phase lag of the hand [deg]"
SPREAD = "spread of the recognised z [mm]"
MEASURES: dict[str, Take] = {
    LAG: lambda row: row.followed.hand_lag_deg,
    SPREAD: lambda row: 1e3 * row.followed.seen_spread[2],
}


@dataclass(frozen=True)
class Changed:
    """What came of a constant's other values: a name for each, and the figure with it.

    `effect` is the greatest change of the figure, and `clear` says whether it is more than runs
    with other seeds differ.
    """

    constant: str
    was: str
    values: tuple[tuple[str, float], ...]
    effect: float
    clear: bool


def sensitivity_sections(
    settings: SensitivitySettings, given: Constants, results: Results, folder: Path
) -> list[Section]:
    """Tell which constants matter for the hand's lag and for the recognised z.

    Raises:
        OutputError: a picture cannot be written.

    """
    base = _rows(results, BASE)
    if len(base) < 2:
        return []
    found = {name: _changed(settings, given, results, take) for name, take in MEASURES.items()}
    middles = {name: interval([take(row) for row in base]) for name, take in MEASURES.items()}
    picture = draw_tornado(
        {name: [Effect(_titled(one), one.values) for one in found[name]] for name in MEASURES},
        {name: (middles[name].mean, _between(base, take)) for name, take in MEASURES.items()},
        folder / "sensitivity.png",
        f"What the paper's method at {period(settings.omega)} does when one constant is changed, "
        "the greatest effects above. The grey band holds 95 % of single runs that differ by their "
        "seed alone.",
    )
    return [
        Section(
            heading="Which of the constants that the paper leaves out matter",
            words=_words(settings, found, middles, len(base)) + failures(_done(results)),
            findings=_findings(found, _every_row(settings, given, results)),
            pictures=(picture,),
            tables=(
                *(_table(name, found[name], middles[name]) for name in MEASURES),
                constants_table(given),
            ),
        )
    ]


def _done(results: Results) -> Sequence[Done]:
    return results.get(SENSITIVITY.name, ())


def _rows(results: Results, name: str) -> list[ServoingRow]:
    return [one.row for one in _done(results) if one.case.name == name and one.row is not None]


def _between(base: Sequence[ServoingRow], take: Take) -> float:
    """Return how far from the mean of the base a single run is in 95 % of cases."""
    spread = interval([take(row) for row in base])
    return (spread.half or 0.0) * math.sqrt(len(base) + 1.0)


def _changed(
    settings: SensitivitySettings, given: Constants, results: Results, take: Take
) -> list[Changed]:
    """Return what each constant's change does to a figure, the greatest effect first."""
    base = _rows(results, BASE)
    middle, band = interval([take(row) for row in base]).mean, _between(base, take)
    now = {name: value for name, value, _, _ in constants(given)}
    values: dict[str, list[tuple[str, float]]] = {}
    for one in changes(settings, given):
        if rows := _rows(results, one.name):
            mean = interval([take(row) for row in rows]).mean
            values.setdefault(one.constant, []).append((one.written, mean))
    found = []
    for constant, pairs in values.items():
        effect = max((value - middle for _, value in pairs), key=abs)
        found.append(Changed(constant, now[constant], tuple(pairs), effect, abs(effect) > band))
    return sorted(found, key=lambda one: -abs(one.effect))


def _titled(one: Changed) -> str:
    others = " | ".join(name for name, _ in one.values)
    return f"{one.constant.replace('_', ' ')}: {one.was}\n({others})"


def _words(
    settings: SensitivitySettings,
    found: dict[str, list[Changed]],
    middles: dict[str, Interval],
    count: int,
) -> tuple[str, ...]:
    tried = sum(len(one.values) for one in found[LAG])
    return (
        "Each constant that the paper leaves out is halved and doubled, or replaced by what else "
        f"it may be, alone: {tried} changes of {len(found[LAG])} constants, {settings.seeds} run "
        f"each, beside {count} runs with all as assumed. Those lag {middles[LAG].written(2)} "
        f"degrees, and their z spreads by {middles[SPREAD].written(2)} mm.",
        "A change counts if it is more than 95 % of single runs differ by their seed: of twenty "
        "that do nothing, one counts all the same, and small effects are to be doubted.",
    )


def _every_row(
    settings: SensitivitySettings, given: Constants, results: Results
) -> list[ServoingRow]:
    return [row for one in changes(settings, given) for row in _rows(results, one.name)]


def _findings(found: dict[str, list[Changed]], rows: Sequence[ServoingRow]) -> tuple[Finding, ...]:
    if not rows:
        return ()
    lag, spread = (_named(found[name]) for name in (LAG, SPREAD))
    late = sum(row.followed.hand_lag_deg > 0.0 for row in rows)
    unsteady = sum(row.followed.seen_spread[2] > row.followed.seen_spread[0] for row in rows)
    return (
        Finding(
            before="Gains, search and cameras are not given.",
            ours=f"The hand's lag depends on {lag}; the spread of z on {spread}. What other "
            "constants do is not more than what the seed does.",
            verdict=Verdict.PARTLY,
            why=f"The hand lags in {late} of {len(rows)} runs with another value, and z is less "
            f"steady than x in {unsteady}: the findings {_hang(min(late, unsteady), len(rows))} on "
            "what is assumed, and the paper's curves cannot be redrawn without it.",
        ),
    )


def _hang(least: int, count: int) -> str:
    """Say how far findings that were met so many times hang on something."""
    if least == count:
        return "do not hang"
    return "hardly hang" if least >= _MOSTLY * count else "hang"


def _named(changed: Sequence[Changed]) -> str:
    """Name the constants whose effect is clear, the greatest first."""
    clear = [_plain(one.constant) for one in changed if one.clear]
    if not clear:
        return "none of them clearly"
    *all_but_last, last = clear
    return f"{', '.join(all_but_last)} and {last}" if all_but_last else last


def _plain(constant: str) -> str:
    """Return the name of a constant in words, without its part and its unit."""
    words = constant.split(".")[1].split("_")
    return " ".join(words[:-1] if words[-1] in _UNITS else words)


def _table(name: str, changed: Sequence[Changed], middle: Interval) -> Table:
    rows = [
        (
            one.constant,
            one.was,
            "; ".join(f"{value}: {figure:.2f}" for value, figure in one.values),
            f"{one.effect:+.2f}",
            "yes" if one.clear else "no",
        )
        for one in changed
    ]
    heads = ("constant", "assumed", f"other value: {name}", "greatest effect", "beyond seeds")
    return Table(heads, rows, f"Sorted by effect on the {name}; as assumed: {middle.written(2)}.")

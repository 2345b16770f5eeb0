"""Reports which assumed constants matter: a table by effect, and a tornado plot."""

from collections.abc import Callable, Sequence
from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.paper.sensitivity.changes import (
    BASE,
    SENSITIVITY,
    SensitivitySettings,
    changes,
)
from servoid_experiments.paper.sensitivity.plot import Effect, draw_tornado
from servoid_experiments.paper.servoing.settings import Constants, constants
from servoid_experiments.paper.servoing.trial import ServoingRow
from servoid_experiments.report import Cell, Finding, Section, Table, Verdict
from servoid_experiments.stats import over

Take = Callable[[ServoingRow], float]

LAG = "phase lag of the hand [deg]"
SPREAD = "spread of the recognised z [mm]"
MEASURES: dict[str, Take] = {
    LAG: lambda row: row.followed.hand_lag_deg,
    SPREAD: lambda row: 1e3 * row.followed.seen_spread[2],
}


def sensitivity_sections(
    settings: SensitivitySettings, given: Constants, results: Results, folder: Path
) -> list[Section]:
    """Draw and list the effect of each changed constant on the hand's lag and the recognised z.

    Raises:
        OutputError: a picture cannot be written.

    """
    base = _rows(results, BASE)
    if len(base) < 2:
        return []
    found = {name: _changed(settings, given, results, take) for name, take in MEASURES.items()}
    middles = {name: over(base, take) for name, take in MEASURES.items()}
    picture = draw_tornado(
        found,
        {name: (one.mean, one.reach) for name, one in middles.items()},
        folder / "sensitivity.png",
        "What the paper's method does at the fast motion when one constant is changed, the "
        "greatest effects above. The grey band holds 95 % of single runs that differ by their seed "
        "alone.",
    )
    rows: list[tuple[Cell, ...]] = [
        (name, one.constant, one.was, one.greatest, "yes" if one.clear else "no")
        for name in MEASURES
        for one in found[name]
    ]
    table = Table(
        "sensitivity_effects",
        "Greatest effect of each constant, and whether it is more than 95 % of single runs differ "
        "by their seed: of twenty constants that do nothing, one counts all the same.",
        ("figure", "constant", "assumed", "greatest_effect", "beyond_seeds"),
        rows,
    )
    counts = _holds_table(settings, given, results)
    finding = Finding("Gains, search and cameras are not given.", Verdict.PARTLY)
    heading = "Which of the constants that the paper leaves out matter"
    return [Section(heading, (finding,), (picture,), (table, counts))]


def _rows(results: Results, name: str) -> list[ServoingRow]:
    done = results.get(SENSITIVITY.name, ())
    return [one.row for one in done if one.case.name == name and one.row is not None]


def _changed(
    settings: SensitivitySettings, given: Constants, results: Results, take: Take
) -> list[Effect]:
    """Return the effect of each constant's change on a figure, the largest first."""
    base = over(_rows(results, BASE), take)
    now = {name: value for name, value, _, _ in constants(given)}
    values: dict[str, list[tuple[str, float]]] = {}
    for one in changes(settings, given):
        if rows := _rows(results, one.name):
            values.setdefault(one.constant, []).append((one.written, over(rows, take).mean))
    found = []
    for constant, pairs in values.items():
        effect = max((value - base.mean for _, value in pairs), key=abs)
        clear = abs(effect) > base.reach
        found.append(Effect(constant, now[constant], tuple(pairs), effect, clear))
    return sorted(found, key=lambda one: -abs(one.greatest))


def _holds_table(settings: SensitivitySettings, given: Constants, results: Results) -> Table:
    """Count the runs with another value in which the paper's findings still hold."""
    rows: Sequence[ServoingRow] = [
        row for one in changes(settings, given) for row in _rows(results, one.name)
    ]
    late = sum(row.followed.hand_lag_deg > 0.0 for row in rows)
    unsteady = sum(row.followed.seen_spread[2] > row.followed.seen_spread[0] for row in rows)
    return Table(
        "sensitivity_holds",
        "Runs with another value, and those in which the hand lags, and z is less steady than x.",
        ("runs", "hand_lags", "z_less_steady_than_x"),
        [(len(rows), late, unsteady)],
    )

"""The tables of the study of tracking."""

from collections.abc import Sequence

from servoid.track import Method
from servoid_experiments.findings import Table
from servoid_experiments.sweeping import (
    Curve,
    Factor,
    Panel,
    Series,
    Value,
    at,
    holding,
    known,
    named,
    written,
)
from servoid_experiments.tracking.cases import TrackCase
from servoid_experiments.tracking.figures import Metric, Trials, position, turn
from servoid_experiments.tracking.metrics import (
    of_tracked,
    success,
    success_at_end,
    wrongly_sure,
)
from servoid_experiments.tracking.plan import Plan
from servoid_experiments.tracking.words import HOLDS


def limits(plan: Plan, panels: Sequence[Panel]) -> Table:
    """Return up to which values each tracker holds."""
    rows = []
    for panel in panels:
        curves = {curve.name: curve for curve in panel.curves if curve.style == "-"}
        cells = [
            _held(curves[one.name], one, panel.factor) if one.name in curves else "-"
            for one in (plan.ours, plan.paper)
        ]
        tried = panel.values
        span = _listed(tried) if panel.has_names else f"{written(tried[0])} to {written(tried[-1])}"
        rows.append((named(panel.factor), written(panel.centers[0]), span, *cells))
    return Table(
        ("factor", "centre", "tried", plan.ours.name, plan.paper.name),
        rows,
        f"From where to where a tracker is right in {100.0 * HOLDS:.0f} % of the images or more, "
        "by the median over the seeds; hidden: while the object is.",
    )


def every_figure(plan: Plan, sweep: Trials, near: float) -> Table:
    """Return one table of all factors, values and figures."""
    rows: list[tuple[str, ...]] = []
    for factor in plan.factors:
        for one in plan.series:
            if factor in plan.factors_of(one):
                rows += [
                    (named(factor), written(value).replace("\n", " "), _who(one, plan), *cells)
                    for value in one.values(factor)
                    for cells in [_figures(sweep, one, (factor, value), near)]
                ]
    return Table(
        (
            "factor",
            "value",
            "tracker",
            "tracked [%]",
            "wrongly sure [%]",
            "tracked in the last quarter [%]",
            "position, median [mm]",
            "position, 95 % [mm]",
            "turn, median [degrees]",
            "poses scored an image",
        ),
        rows,
        "Tracked: said to be tracked and right; wrongly sure: said to be tracked and not right.",
    )


def _figures(
    sweep: Trials, series: Series[TrackCase], place: tuple[Factor, Value], near: float
) -> tuple[str, ...]:
    def text(metric: Metric, digits: int, factor: float = 1.0) -> str:
        spread = sweep.spread(series, place, metric)
        return "-" if spread is None else spread.text(digits, factor)

    told = series.centers[0].method is Method.PAPER
    return (
        text(lambda row: success(row, near), 0, 100.0),
        text(lambda row: wrongly_sure(row, near), 0, 100.0),
        text(lambda row: success_at_end(row, near), 0, 100.0),
        text(of_tracked(position, 50.0), 2),
        text(of_tracked(position, 95.0), 1),
        "told" if told else text(of_tracked(turn, 50.0), 2),
        text(lambda row: row.evaluations, 0),
    )


def _held(curve: Curve, series: Series[TrackCase], factor: Factor) -> str:
    """Write where a tracker holds: about the centre, then wherever else it was tried."""
    center = series.center(factor)
    values = holding(curve, center, lambda share: share >= HOLDS)
    others = [value for value, share in known(curve) if share >= HOLDS and value not in values]
    elsewhere = f"at {_listed(others)}" if others else ""
    if not values:
        share = at(curve, center)
        here = "" if share is None else f"; {100.0 * share:.0f} % in the centre"
        return f"{elsewhere or 'nowhere'}{here}"
    if not all(isinstance(value, float | int) for value in values):
        return _listed(values)
    first, last = written(values[0]), written(values[-1])
    about = f"only at {first}" if len(values) == 1 else f"{first} to {last}"
    return f"{about}, and {elsewhere}" if elsewhere else about


def _who(series: Series[TrackCase], plan: Plan) -> str:
    if series is plan.thorough:
        return f"{series.name}, {series.centers[0].generations} generations"
    if series in plan.other_eyes:
        return f"{series.name}, {series.centers[0].scene.eyes.value} eyes"
    return series.name


def _listed(values: Sequence[Value]) -> str:
    return ", ".join(written(value).replace("\n", " ") for value in values)

"""Reports the study of tracking: success and errors over each factor."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from servoid.output import write_together
from servoid_experiments.design import Results
from servoid_experiments.report import Picture, Section, Table
from servoid_experiments.sweeping import (
    BANDS,
    Curve,
    Factor,
    Panel,
    Scale,
    Series,
    Sweep,
    draw_panels,
    panels_csv,
    written,
)
from servoid_experiments.tracking.cases import TrackCase, TrackRow
from servoid_experiments.tracking.plan import BASELINE, HIDDEN, WAY, Plan, layout
from servoid_experiments.tracking.settings import TrackStudySettings
from servoid_experiments.tracking.success import (
    of_tracked,
    success,
    success_at_end,
    success_behind_board,
    wrongly_sure,
)
from servoid_experiments.tracking.trial import TRACKING

Trials = Sweep[TrackCase, TrackRow]
Metric = Callable[[TrackRow], float | None]

_TRACKED = "of the images in which the tracker says that it tracks."
_PICTURES = {
    "success": (
        "success",
        Scale("images tracked rightly [share]", -0.04, 1.06),
        "Share of the images in which the tracker says that it tracks, and is right. Where a board "
        "hides the object, solid lines are the images in which it does, dashed ones those after.",
    ),
    "error": (
        "median_position_error_mm",
        Scale("median error of position [mm]", log=True),
        f"Median error of the object's middle, {_TRACKED}",
    ),
    "large_errors": (
        "position_error_95_percent_mm",
        Scale("95 % of errors of position below [mm]", log=True),
        f"Error of the object's middle that 95 % stay below, {_TRACKED}",
    ),
}
"""File, figure in its CSV, scale and caption."""


def position(row: TrackRow) -> list[float]:
    """Return the position errors."""
    return row.position_mm


def turn(row: TrackRow) -> list[float]:
    """Return the rotation errors."""
    return row.turn_deg


def report_tracking(settings: TrackStudySettings, results: Results, folder: Path) -> list[Section]:
    """Draw success, usual and large errors, with their numbers, and list all figures.

    Raises:
        OutputError: a file cannot be written.

    """
    sweep: Trials = Sweep(results[TRACKING.name])
    if sweep.is_empty:
        return [Section("No trial succeeded")]
    plan, near = layout(settings), settings.near
    panels = (
        success_panels(plan, sweep, near),
        error_panels(plan, sweep, 50.0),
        error_panels(plan, sweep, 95.0),
    )
    files: dict[Path, bytes] = {}
    for (name, (figure, scale, _)), shown in zip(_PICTURES.items(), panels, strict=True):
        files[folder / f"{name}.png"] = draw_panels(shown, scale)
        files[folder / f"{name}.csv"] = panels_csv(shown, figure)
    write_together(files)
    pictures = [
        Picture(folder / f"{name}.png", f"{caption} {BANDS}")
        for name, (_, _, caption) in _PICTURES.items()
    ]
    return [
        Section("How often and how precisely objects are tracked", pictures=tuple(pictures)),
        Section("All figures", tables=(_every_figure(plan, sweep, near),)),
    ]


def _every_figure(plan: Plan, sweep: Trials, near: float) -> Table:
    metrics: dict[str, Metric] = {
        "tracked": lambda row: success(row, near),
        "wrongly_sure": lambda row: wrongly_sure(row, near),
        "tracked_in_last_quarter": lambda row: success_at_end(row, near),
        "position_median_mm": of_tracked(position, 50.0),
        "position_95_percent_mm": of_tracked(position, 95.0),
        "turn_median_deg": of_tracked(turn, 50.0),
        "poses_scored_an_image": lambda row: row.evaluations,
    }
    rows = []
    for factor in plan.factors:
        for one in plan.series:
            for value in one.values(factor) if factor in plan.factors_of(one) else ():
                center = one.centers[0]
                at = (factor.title, factor.unit, written(value).replace("\n", "_"), one.name)
                spreads = [sweep.spread(one, (factor, value), take) for take in metrics.values()]
                cells = [None if one is None else one.middle for one in spreads]
                rows.append((*at, center.generations, center.scene.eyes.value, *cells))
    return Table(
        "tracking",
        "Medians over the seeds. Tracked: said to be tracked, and right; wrongly sure: said to be "
        "tracked, and not right.",
        ("factor", "unit", "value", "tracker", "generations", "eyes", *metrics),
        rows,
    )


def success_panels(plan: Plan, sweep: Trials, near: float) -> list[Panel]:
    """Return the panels of success; if a board hides the object, during and after that."""

    def whole(row: TrackRow) -> float:
        return success(row, near)

    def behind(row: TrackRow) -> float:
        return success_behind_board(row, near)

    def at_end(row: TrackRow) -> float:
        return success_at_end(row, near)

    panels = []
    for factor in plan.factors:
        if factor.key == HIDDEN:
            panel = sweep.panel(_solid(plan, factor), factor, behind, note="dashed: afterwards")
            after = [
                replace(sweep.curve(one, factor, at_end), style="--")
                for one in _solid(plan, factor)
            ]
            panels.append(replace(panel, curves=(*panel.curves, *after)))
        else:
            panels.append(_panel(plan, sweep, factor, whole))
    return panels


def error_panels(plan: Plan, sweep: Trials, percent: float) -> list[Panel]:
    """Return the panels of a percentile of the position error, of images reported as tracked."""
    metric = of_tracked(position, percent)
    return [_panel(plan, sweep, factor, metric) for factor in plan.factors]


def _panel(plan: Plan, sweep: Trials, factor: Factor, metric: Metric) -> Panel:
    more: Sequence[Curve] = ()
    note = ""
    if factor.key == WAY and plan.thorough is not None:
        more = [sweep.curve(plan.thorough, factor, metric)]
        note = f"dashed: {plan.thorough.centers[0].generations} generations"
    if factor.key == BASELINE:
        more = [sweep.curve(one, factor, metric) for one in plan.other_eyes]
        note = f"dashed: {plan.other_eyes[0].centers[0].scene.eyes.value} eyes"
    return sweep.panel(_solid(plan, factor), factor, metric, more=more, note=note)


def _solid(plan: Plan, factor: Factor) -> list[Series[TrackCase]]:
    """Return the series in the centre in which a factor is varied."""
    return [one for one in (plan.ours, plan.paper) if factor in plan.factors_of(one)]

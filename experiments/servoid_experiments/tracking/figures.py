"""What the study of tracking draws: success and errors over each factor."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from servoid.output import write_together
from servoid_experiments.sweeping import (
    Curve,
    Factor,
    Panel,
    Scale,
    Series,
    Sweep,
    draw_panels,
    panels_csv,
)
from servoid_experiments.tracking.cases import TrackCase, TrackRow
from servoid_experiments.tracking.metrics import (
    of_tracked,
    success,
    success_at_end,
    success_behind_board,
)
from servoid_experiments.tracking.plan import BASELINE, HIDDEN, WAY, Plan

Trials = Sweep[TrackCase, TrackRow]
Metric = Callable[[TrackRow], float | None]

SUCCESS, MIDDLE_ERROR, LARGE_ERROR = "success.png", "error.png", "large_errors.png"


def position(row: TrackRow) -> list[float]:
    """Return the errors in position."""
    return row.position_mm


def turn(row: TrackRow) -> list[float]:
    """Return the errors in turn."""
    return row.turn_deg


def draw_tracking(plan: Plan, sweep: Trials, near: float, folder: Path) -> None:
    """Write the pictures of success, of usual and of large errors, and their numbers as CSV.

    Raises:
        OutputError: one cannot be written; then none changes.

    """
    share = Scale("images tracked rightly [share]", -0.04, 1.06)
    pages: dict[str, tuple[list[Panel], Scale, str]] = {
        SUCCESS: (success_panels(plan, sweep, near), share, "success"),
        MIDDLE_ERROR: (
            error_panels(plan, sweep, 50.0),
            Scale("median error of position [mm]", log=True),
            "median_position_error_mm",
        ),
        LARGE_ERROR: (
            error_panels(plan, sweep, 95.0),
            Scale("95 % of errors of position below [mm]", log=True),
            "position_error_95_percent_mm",
        ),
    }
    files: dict[Path, bytes] = {}
    for name, (panels, scale, figure) in pages.items():
        files[folder / name] = draw_panels(panels, scale)
        files[(folder / name).with_suffix(".csv")] = panels_csv(panels, figure)
    write_together(files)


def success_panels(plan: Plan, sweep: Trials, near: float) -> list[Panel]:
    """Return the panels of success; where a board hides the object, while it does and after it."""

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
    """Return the panels of a percentile of the error in position, of what is said to be tracked."""
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

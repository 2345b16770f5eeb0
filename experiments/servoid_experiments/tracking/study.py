"""The study of tracking: its limits and its precision."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from servoid.batch import Results
from servoid_experiments.design import Section, Study, Table
from servoid_experiments.panels import Scale, picture_of, written
from servoid_experiments.sweep import Panel, Series, Sweep
from servoid_experiments.tracking.plan import (
    HIDDEN,
    QUICK,
    TrackStudySettings,
    plan_tracking,
    series_of,
)
from servoid_experiments.tracking.scene import last_quarter
from servoid_experiments.tracking.trial import TRACKING, TrackCase, TrackRow

Trials = Sweep[TrackCase, TrackRow]
Metric = Callable[[TrackRow], float | None]
AllSeries = Sequence[Series[TrackCase]]

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


def success(row: TrackRow, near: float) -> float:
    """Return the share of images that the tracker reports as tracked, and rightly.

    A pose is right if ADD is at most `near` diameters.
    """
    return float(np.mean(_right(row, near)))


def wrongly_sure(row: TrackRow, near: float) -> float:
    """Return the share of images that the tracker reports as tracked, but wrongly."""
    return float(np.mean(_tracking(row) & ~_right(row, near)))


def success_behind_board(row: TrackRow, near: float) -> float:
    """Return the success in the third quarter, where a board may hide the object."""
    images = len(row.status) + 1
    return float(np.mean(_right(row, near)[images // 2 - 1 : last_quarter(images) - 1]))


def success_at_end(row: TrackRow, near: float) -> float:
    """Return the success in the last quarter, after all disturbances."""
    return float(np.mean(_right(row, near)[last_quarter(len(row.status) + 1) - 1 :]))


def of_tracked(
    errors: Callable[[TrackRow], list[float]], percent: float
) -> Callable[[TrackRow], float | None]:
    """Return a function for a percentile of an error over the images reported as tracked."""

    def percentile(row: TrackRow) -> float | None:
        known = np.array(errors(row))[_tracking(row)]
        return float(np.percentile(known, percent)) if len(known) else None

    return percentile


def _tracking(row: TrackRow) -> np.ndarray:
    return np.array(row.status) == "tracking"


def _right(row: TrackRow, near: float) -> np.ndarray:
    return _tracking(row) & (np.array(row.add_share) <= near)


def report_tracking(settings: TrackStudySettings, results: Results) -> list[Section]:
    """Draw success, usual and large errors, with their numbers, and list all figures."""
    sweep: Trials = Sweep(results[TRACKING.name])
    if not sweep.rows:
        return [Section("No trial succeeded")]
    series, near = series_of(settings), settings.near
    panels = (
        success_panels(series, sweep, near),
        *(
            [sweep.panel(series, factor, _position(percent)) for factor in series[0].factors]
            for percent in (50.0, 95.0)
        ),
    )
    pictures = [
        picture_of(shown, scale, name, figure, caption)
        for shown, (name, (figure, scale, caption)) in zip(panels, _PICTURES.items(), strict=True)
    ]
    return [
        Section("How often and how precisely objects are tracked", pictures=pictures),
        Section("All figures", tables=(_every_figure(series, sweep, near),)),
    ]


def success_panels(series: AllSeries, sweep: Trials, near: float) -> list[Panel]:
    """Return the panels of success; if a board hides the object, during and after that."""
    panels = []
    for factor in series[0].factors:
        panel = sweep.panel(series, factor, lambda row: success(row, near))
        if factor.key == HIDDEN:
            behind, after = (
                sweep.panel(series, factor, lambda row, part=part: part(row, near)).curves
                for part in (success_behind_board, success_at_end)
            )
            after = [replace(one, style="--") for one in after]
            panel = replace(panel, curves=(*behind, *after), note="dashed: afterwards")
        panels.append(panel)
    return panels


def _position(percent: float) -> Metric:
    return of_tracked(lambda row: row.position_mm, percent)


def _every_figure(series: AllSeries, sweep: Trials, near: float) -> Table:
    metrics: dict[str, Metric] = {
        "tracked": lambda row: success(row, near),
        "wrongly_sure": lambda row: wrongly_sure(row, near),
        "tracked_in_last_quarter": lambda row: success_at_end(row, near),
        "position_median_mm": _position(50.0),
        "position_95_percent_mm": _position(95.0),
        "turn_median_deg": of_tracked(lambda row: row.turn_deg, 50.0),
        "poses_scored_an_image": lambda row: row.evaluations,
    }
    rows = []
    for factor in series[0].factors:
        for one in series:
            for value in one.values(factor) if factor in one.factors else ():
                center = one.centers[0]
                at = (factor.title, factor.unit, written(value).replace("\n", "_"), one.name)
                spreads = [sweep.spread(one, (factor, value), take) for take in metrics.values()]
                cells = [None if one is None else one.middle for one in spreads]
                rows.append((*at, center.generations, center.scene.eyes.value, *cells))
    return Table(
        "tracking",
        ("factor", "unit", "value", "tracker", "generations", "eyes", *metrics),
        rows,
        "Medians over the seeds. Tracked: said to be tracked, and right; wrongly sure: said to be "
        "tracked, and not right.",
    )


TRACK = Study(
    name="track",
    title="Until when an object is tracked, and how well",
    question=(
        "What tracking bears, one factor at a time around a common case: fast motion, few "
        "hypotheses, coarse bodies, noise, light, something before the object, and how the eyes "
        "stand; for servoid's tracker and for the paper's 1-step GA"
    ),
    settings=TrackStudySettings,
    quick=QUICK,
    plan=plan_tracking,
    report=report_tracking,
)

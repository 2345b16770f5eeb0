"""What the study of modelling draws: how good bodies are, and how long they take."""

from collections.abc import Callable
from pathlib import Path
from statistics import fmean

from servoid.output import write_together
from servoid_experiments.modelling.cases import ModelCase, ModelRow
from servoid_experiments.modelling.plan import Plan
from servoid_experiments.sweeping import Factor, Scale, Sweep, Value, draw_panels, panels_csv

Trials = Sweep[ModelCase, ModelRow]
Metric = Callable[[ModelRow], float | None]

VOLUME, OUTLINE, SECONDS = "volume.png", "outline.png", "seconds.png"


def volume(row: ModelRow) -> float:
    """Return the intersection over union of the volume."""
    return row.volume_iou


def outline(row: ModelRow) -> float:
    """Return the intersection over union of outlines in views that were not used."""
    return row.outline_iou


def filling(row: ModelRow) -> float:
    """Return the body's volume over the object's."""
    return row.volume_share


def seconds(row: ModelRow) -> float:
    """Return how long modelling took."""
    return row.seconds


def mean_of_objects(
    plan: Plan, sweep: Trials, place: tuple[Factor, Value], metric: Metric
) -> float | None:
    """Return the median over the seeds, on average over the objects; None if one is not known."""
    spreads = [sweep.spread(one, place, metric) for one in plan.series]
    known = [spread.middle for spread in spreads if spread is not None]
    return fmean(known) if known and len(known) == len(spreads) else None


def draw_modelling(plan: Plan, sweep: Trials, folder: Path) -> None:
    """Write the pictures of volume, outlines and seconds, and their numbers as CSV.

    Raises:
        OutputError: one cannot be written; then none changes.

    """
    pages: dict[str, tuple[Metric, Scale, str]] = {
        VOLUME: (volume, Scale("IoU of the volume", high=1.02), "volume_iou"),
        OUTLINE: (outline, Scale("IoU of unused outlines", high=1.02), "outline_iou"),
        SECONDS: (seconds, Scale("seconds of one processor", log=True), "seconds"),
    }
    files: dict[Path, bytes] = {}
    for name, (metric, scale, figure) in pages.items():
        panels = [sweep.panel(plan.series, factor, metric) for factor in plan.factors]
        files[folder / name] = draw_panels(panels, scale)
        files[(folder / name).with_suffix(".csv")] = panels_csv(panels, figure)
    write_together(files)

"""Reports the study of modelling: the quality of bodies, and the time that they take."""

from collections.abc import Callable
from pathlib import Path
from statistics import fmean

from servoid.output import write_together
from servoid_experiments.design import Results
from servoid_experiments.modelling.cases import ModelCase, ModelRow
from servoid_experiments.modelling.plan import Plan, layout
from servoid_experiments.modelling.settings import ModelStudySettings
from servoid_experiments.modelling.trial import MODELLING
from servoid_experiments.report import Cell, Picture, Section, Table
from servoid_experiments.sweeping import (
    BANDS,
    Factor,
    Scale,
    Sweep,
    Value,
    draw_panels,
    panels_csv,
    written,
)

Trials = Sweep[ModelCase, ModelRow]
Metric = Callable[[ModelRow], float]

METRICS: dict[str, Metric] = {
    "volume_iou": lambda row: row.volume_iou,
    "outline_iou": lambda row: row.outline_iou,
    "volume_share": lambda row: row.volume_share,
    "seconds": lambda row: row.seconds,
}
"""IoU of the volume and of unused outlines, the body's volume over the object's, and the time."""

_PICTURES = {
    "volume": ("volume_iou", Scale("IoU of the volume", high=1.02), "IoU of the volume."),
    "outline": (
        "outline_iou",
        Scale("IoU of unused outlines", high=1.02),
        "IoU of outlines in views that were not modelled from.",
    ),
    "seconds": (
        "seconds",
        Scale("seconds of one processor", log=True),
        "Seconds of one processor for modelling; they depend on the machine.",
    ),
}


def report_modelling(settings: ModelStudySettings, results: Results, folder: Path) -> list[Section]:
    """Draw the pictures into a folder, their numbers beside them, and list all figures.

    Raises:
        OutputError: a file cannot be written.

    """
    sweep: Trials = Sweep(results[MODELLING.name])
    if sweep.is_empty:
        return [Section("No trial succeeded")]
    plan = layout(settings)
    pictures, files = [], {}
    for name, (metric, scale, caption) in _PICTURES.items():
        panels = [sweep.panel(plan.series, factor, METRICS[metric]) for factor in plan.factors]
        pictures.append(Picture(folder / f"{name}.png", f"{caption} {BANDS}"))
        files[folder / f"{name}.png"] = draw_panels(panels, scale)
        files[folder / f"{name}.csv"] = panels_csv(panels, metric)
    write_together(files)
    return [
        Section("What bodies are worth", pictures=tuple(pictures)),
        Section("All figures", tables=(_every_figure(plan, sweep),)),
    ]


def _every_figure(plan: Plan, sweep: Trials) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for factor in plan.factors:
        for value in plan.series[0].values(factor):
            at = (factor.title, factor.unit, written(value))
            rows.append((*at, "all", *(_mean(plan, sweep, (factor, value), x) for x in METRICS)))
            for one in plan.series:
                spreads = [sweep.spread(one, (factor, value), take) for take in METRICS.values()]
                rows.append((*at, one.name, *(x.middle if x else None for x in spreads)))
    return Table(
        "modelling",
        "Medians over the seeds; those of all are means over the objects.",
        ("factor", "unit", "value", "object", *METRICS),
        rows,
    )


def _mean(plan: Plan, sweep: Trials, place: tuple[Factor, Value], metric: str) -> float | None:
    """Return the median over the seeds, averaged over the objects; None if one is unknown."""
    spreads = [sweep.spread(one, place, METRICS[metric]) for one in plan.series]
    known = [spread.middle for spread in spreads if spread is not None]
    return fmean(known) if len(known) == len(spreads) else None

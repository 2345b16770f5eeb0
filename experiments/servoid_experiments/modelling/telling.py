"""What the study of modelling found, in sentences, pictures and a table."""

from math import degrees
from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.findings import Picture, Section, Table
from servoid_experiments.modelling.around import GOLDEN
from servoid_experiments.modelling.designs import VOXELS
from servoid_experiments.modelling.figures import (
    OUTLINE,
    SECONDS,
    VOLUME,
    Metric,
    Trials,
    draw_modelling,
    filling,
    mean_of_objects,
    outline,
    seconds,
    volume,
)
from servoid_experiments.modelling.plan import Plan, layout
from servoid_experiments.modelling.settings import ModelStudySettings
from servoid_experiments.modelling.trial import AWAY, ELEVATIONS_DEG, JUDGES, MODELLING
from servoid_experiments.modelling.words import (
    center_words,
    enough_words,
    filling_words,
    matter_words,
    time_words,
)
from servoid_experiments.sweeping import band_words, failure_words, named, written


def tell_modelling(settings: ModelStudySettings, results: Results, folder: Path) -> list[Section]:
    """Draw the pictures into a folder and say what came out.

    Raises:
        OutputError: a file cannot be written.

    """
    sweep: Trials = Trials(results[MODELLING.name])
    if sweep.is_empty:
        return [Section("No trial succeeded", failure_words(sweep.failed))]
    plan = layout(settings)
    draw_modelling(plan, sweep, folder)
    width, height = settings.size_px
    return [
        Section(
            "What matters most",
            (
                *matter_words(plan, sweep),
                *center_words(plan, sweep),
                *enough_words(plan, sweep),
                *filling_words(plan, sweep),
            ),
            pictures=(
                Picture(
                    folder / VOLUME,
                    "Volume that body and object share, over that which either holds. One panel a "
                    "factor; all else is as in the centre. " + band_words(settings.seeds),
                ),
                Picture(
                    folder / OUTLINE,
                    f"The same of outlines in {JUDGES} views that were not modelled from, whose "
                    "masks and poses are exact.",
                ),
            ),
        ),
        Section(
            "How long it takes",
            tuple(time_words(plan, sweep)),
            pictures=(
                Picture(
                    folder / SECONDS,
                    "Seconds that one processor takes for modelling. They depend on the machine.",
                ),
            ),
        ),
        Section("All figures", tables=(_every_figure(plan, sweep),)),
        Section(
            "How it was done",
            (
                f"{sweep.count} trials. Masks of {width} x {height} pixels are drawn from the "
                f"objects' designs by cameras {AWAY:g} m away, {degrees(GOLDEN):.1f} degrees from "
                f"one to the next and at {len(ELEVATIONS_DEG)} heights in turn; where the first "
                "one stands, the noise and the search differ from seed to seed.",
                "The volume is compared in the place where the object truly stands, in "
                f"{VOXELS} voxels "
                "along its longest side. A hollow that is walled in on all sides, as a mug's, "
                "counts as full: no outline shows it.",
                "Outlines are off by smooth noise; wrong pixels lie anywhere in the mask; cameras "
                "are off by independent errors about each axis.",
                *failure_words(sweep.failed),
            ),
        ),
    ]


def _every_figure(plan: Plan, sweep: Trials) -> Table:
    rows: list[tuple[str, ...]] = []
    for factor in plan.factors:
        for value in plan.series[0].values(factor):
            place = (factor, value)

            def mean(metric: Metric, digits: int, place: tuple = place) -> str:
                found = mean_of_objects(plan, sweep, place, metric)
                return "-" if found is None else f"{found:.{digits}f}"

            each = [sweep.spread(one, place, volume) for one in plan.series]
            rows.append(
                (
                    named(factor),
                    written(value),
                    mean(volume, 3),
                    mean(outline, 3),
                    mean(filling, 2),
                    mean(seconds, 2),
                    *("-" if one is None else one.text(3) for one in each),
                )
            )
    return Table(
        (
            "factor",
            "value",
            "volume IoU",
            "outline IoU",
            "volume of the body over the object's",
            "seconds",
            *(f"volume IoU, {one.name}" for one in plan.series),
        ),
        rows,
        "First on average over the objects, then for each; the median over the seeds, and in "
        "brackets the extremes.",
    )

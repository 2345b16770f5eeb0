"""The study of modelling: the quality of a body by its inputs."""

from collections.abc import Sequence
from operator import attrgetter
from statistics import fmean
from typing import Annotated

from msgspec import Struct
from msgspec.structs import asdict

from servoid.batch import Results, Work
from servoid.view.axes import DISTINCT
from servoid_experiments.design import Cell, Count, NotNegative, Section, Study, Table, about
from servoid_experiments.modelling.designs import DESIGNS
from servoid_experiments.modelling.trial import MODELLING, ModelCase, ModelRow, Share, Views
from servoid_experiments.panels import Scale, picture_of, written
from servoid_experiments.sweep import (
    Factor,
    Series,
    Sweep,
    Value,
    check_names,
    check_varied,
)

Size = Annotated[tuple[Count, Count], about("width and height of a mask")]

_FIGURES = ("volume_iou", "outline_iou", "volume_share", "seconds")

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


class CenterSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The case in the centre: factors that are not varied have these values."""

    views: Annotated[Views, about("masks from all sides")] = 12
    ellipsoids: Annotated[Count, about("of the body")] = 5
    edge_px: Annotated[NotNegative, about("by which outlines are off")] = 0.0
    flipped: Annotated[Share, about("share of a mask's pixels that are wrong")] = 0.0
    holes: Annotated[Share, about("share of the object that masks miss")] = 0.0
    place_mm: Annotated[NotNegative, about("by which cameras are off")] = 0.0
    turn_deg: Annotated[NotNegative, about("by which cameras are turned off")] = 0.0


class SweepSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The values of each factor, which are varied one at a time; empty: not varied."""

    views: Annotated[tuple[Views, ...], about("masks")] = (2, 3, 4, 6, 8, 16, 24)
    ellipsoids: Annotated[tuple[Count, ...], about("of the body")] = (1, 2, 3, 8, 12)
    edge_px: Annotated[tuple[NotNegative, ...], about("pixels")] = (1.0, 2.0, 4.0, 8.0)
    flipped: Annotated[tuple[Share, ...], about("share of the pixels")] = (
        0.02, 0.05, 0.1, 0.2, 0.3,
    )  # fmt: skip
    holes: Annotated[tuple[Share, ...], about("share of the object")] = (0.05, 0.1, 0.2, 0.4)
    place_mm: Annotated[tuple[NotNegative, ...], about("mm")] = (1.0, 2.0, 5.0, 10.0)
    turn_deg: Annotated[tuple[NotNegative, ...], about("degrees")] = (0.1, 0.2, 0.5, 1.0, 2.0)

    def __post_init__(self) -> None:
        """Raise a StudyError if nothing is varied."""
        check_varied(self)


class ModelStudySettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the study of modelling."""

    objects: Annotated[
        tuple[str, ...],
        about("the sample's bird, and shipped objects", min_length=1),
    ] = ("bird", "bottle", "drill", "mug")
    seeds: Annotated[int, about("trials a case: where views begin, noise and searches", ge=1)] = 5
    size_px: Size = (320, 240)
    center: CenterSettings = CenterSettings()
    sweep: SweepSettings = SweepSettings()

    def __post_init__(self) -> None:
        """Raise a StudyError if there is no such object."""
        check_names(self.objects, DESIGNS)


QUICK = ModelStudySettings(
    objects=("bottle", "drill"),
    seeds=2,
    center=CenterSettings(views=6, ellipsoids=3),
    sweep=SweepSettings(
        views=(3,),
        ellipsoids=(1,),
        edge_px=(4.0,),
        flipped=(0.1,),
        holes=(0.2,),
        place_mm=(10.0,),
        turn_deg=(1.0,),
    ),
)


def plan_modelling(settings: ModelStudySettings) -> list[Work]:
    """Return the trials of the settings."""
    return [Work(MODELLING, [case for one in series_of(settings) for case in one.cases()])]


def series_of(settings: ModelStudySettings) -> list[Series[ModelCase]]:
    """Return the cases in the centre: a series for each object, with all seeds."""
    factors = _factors(settings)
    fixed = {**asdict(settings.center), "size_px": settings.size_px}
    return [
        Series(
            name,
            DISTINCT[place % len(DISTINCT)],
            tuple(ModelCase(object=name, seed=seed, **fixed) for seed in range(settings.seeds)),
            factors,
        )
        for place, name in enumerate(settings.objects)
    ]


def _factors(settings: ModelStudySettings) -> tuple[Factor, ...]:
    """Return the factors that the settings vary."""
    sweep = settings.sweep
    every = (
        Factor("views", "views", "", sweep.views, log=True),
        Factor("ellipsoids", "ellipsoids", "", sweep.ellipsoids),
        Factor("edge_px", "outlines off by", "px", sweep.edge_px),
        Factor("flipped", "wrong pixels in masks", "share", sweep.flipped),
        Factor("holes", "holes in masks", "share", sweep.holes),
        Factor("place_mm", "cameras off by", "mm", sweep.place_mm),
        Factor("turn_deg", "cameras turned off by", "degrees", sweep.turn_deg),
    )
    return tuple(one for one in every if one.values)


def report_modelling(settings: ModelStudySettings, results: Results) -> list[Section]:
    """Draw the pictures with their numbers, and list all figures."""
    sweep: Sweep[ModelCase, ModelRow] = Sweep(results[MODELLING.name])
    if not sweep.rows:
        return [Section("No trial succeeded")]
    series, factors = series_of(settings), _factors(settings)
    pictures = []
    for name, (figure, scale, caption) in _PICTURES.items():
        panels = [sweep.panel(series, factor, attrgetter(figure)) for factor in factors]
        pictures.append(picture_of(panels, scale, name, figure, caption))
    rows: list[tuple[Cell, ...]] = []
    for factor in factors:
        for value in series[0].values(factor):
            at = (factor.title, factor.unit, written(value))
            medians = {one.name: _medians(sweep, one, (factor, value)) for one in series}
            rows.append((*at, "all", *map(_mean, zip(*medians.values(), strict=True))))
            rows += [(*at, name, *cells) for name, cells in medians.items()]
    table = Table(
        "modelling",
        ("factor", "unit", "value", "object", *_FIGURES),
        rows,
        "Medians over the seeds; those of all are means over the objects.",
    )
    return [
        Section("What bodies are worth", pictures=pictures),
        Section("All figures", tables=(table,)),
    ]


def _medians(
    sweep: Sweep[ModelCase, ModelRow], series: Series[ModelCase], at: tuple[Factor, Value]
) -> list[float | None]:
    """Return the median of each figure over the seeds, None if it is unknown."""
    spreads = [sweep.spread(series, at, attrgetter(name)) for name in _FIGURES]
    return [None if spread is None else spread.middle for spread in spreads]


def _mean(medians: Sequence[float | None]) -> float | None:
    """Return the mean over the objects; None if one is unknown."""
    known = [one for one in medians if one is not None]
    return fmean(known) if len(known) == len(medians) else None


MODEL = Study(
    name="model",
    title="How good a body is, by what it was made of",
    question=(
        "How many views and ellipsoids a body needs, what masks and camera poses that are not "
        "exact do to it, and how long modelling takes; on objects whose shape is known"
    ),
    settings=ModelStudySettings,
    quick=QUICK,
    plan=plan_modelling,
    report=report_modelling,
)

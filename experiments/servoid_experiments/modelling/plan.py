"""The trials of the study of modelling."""

from dataclasses import dataclass

from servoid.view.axes import DISTINCT
from servoid_experiments.design import Work
from servoid_experiments.modelling.cases import ModelCase
from servoid_experiments.modelling.settings import ModelStudySettings
from servoid_experiments.modelling.trial import MODELLING
from servoid_experiments.sweeping import Factor, Series, cases_around

VIEWS, ELLIPSOIDS = "views", "ellipsoids"


@dataclass(frozen=True)
class Plan:
    """The varied factors and their centres: each object, with all seeds."""

    factors: tuple[Factor, ...]
    series: tuple[Series[ModelCase], ...]


def plan_modelling(settings: ModelStudySettings) -> list[Work]:
    """Return the trials of the settings."""
    plan = layout(settings)
    cases = [case for one in plan.series for case in cases_around(one.centers, plan.factors)]
    return [Work(MODELLING, cases)]


def layout(settings: ModelStudySettings) -> Plan:
    """Return the factors that the settings vary, and their centres."""
    series = tuple(
        Series(name, DISTINCT[place % len(DISTINCT)], _centers(settings, name))
        for place, name in enumerate(settings.objects)
    )
    return Plan(_factors(settings), series)


def _centers(settings: ModelStudySettings, name: str) -> tuple[ModelCase, ...]:
    center = settings.center
    return tuple(
        ModelCase(
            object=name,
            views=center.views,
            ellipsoids=center.ellipsoids,
            edge_px=center.edge_px,
            flipped=center.flipped,
            holes=center.holes,
            place_mm=center.place_mm,
            turn_deg=center.turn_deg,
            size_px=settings.size_px,
            seed=seed,
        )
        for seed in range(settings.seeds)
    )


def _factors(settings: ModelStudySettings) -> tuple[Factor, ...]:
    sweep = settings.sweep
    every = (
        Factor(VIEWS, "views", "", sweep.views, log=True),
        Factor(ELLIPSOIDS, "ellipsoids", "", sweep.ellipsoids),
        Factor("edge_px", "outlines off by", "px", sweep.edge_px),
        Factor("flipped", "wrong pixels in masks", "share", sweep.flipped),
        Factor("holes", "holes in masks", "share", sweep.holes),
        Factor("place_mm", "cameras off by", "mm", sweep.place_mm),
        Factor("turn_deg", "cameras turned off by", "degrees", sweep.turn_deg),
    )
    return tuple(one for one in every if one.values)

"""The study of the paper: all its experiments, from one settings file."""

from collections.abc import Sequence

import msgspec

from servoid.batch import Results, Work
from servoid_experiments.design import Section, Study
from servoid_experiments.paper.maps.fitness_map import FITNESS_MAP
from servoid_experiments.paper.maps.report import QUICK_MAP, MapSettings, map_section, map_work
from servoid_experiments.paper.sensitivity import (
    SensitivitySettings,
    quick_sensitivity,
    sensitivity_sections,
    sensitivity_work,
)
from servoid_experiments.paper.servoing.report import servoing_sections
from servoid_experiments.paper.servoing.runs import ServoingSettings, quick_servoing, servoing_work
from servoid_experiments.paper.two.modelling import TWO_ELLIPSOIDS
from servoid_experiments.paper.two.report import QUICK_TWO, TwoSettings, two_section, two_work


class PaperStudySettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's experiments; constants that it does not state are called assumed."""

    map: MapSettings = MapSettings()
    two: TwoSettings = TwoSettings()
    servoing: ServoingSettings = ServoingSettings()
    sensitivity: SensitivitySettings = SensitivitySettings()


def plan_paper(settings: PaperStudySettings) -> list[Work]:
    """Return the trials of Figs. 8 to 11, and of the constants."""
    return [
        map_work(settings.map),
        two_work(settings.two),
        *servoing_work(settings.servoing),
        *sensitivity_work(settings.sensitivity, settings.servoing.constants),
    ]


def report_paper(settings: PaperStudySettings, results: Results) -> Sequence[Section]:
    """Draw each figure, and list its numbers."""
    constants = settings.servoing.constants
    return [
        map_section(settings.map, results[FITNESS_MAP.name]),
        two_section(settings.two, results[TWO_ELLIPSOIDS.name]),
        *servoing_sections(settings.servoing, results),
        *sensitivity_sections(settings.sensitivity, constants, results),
    ]


PAPER = Study(
    name="paper",
    title="The paper's experiments again",
    question=(
        "What do the experiments of 'Modeling of Arbitrary-Shaped Objects by Evolving-Ellipsoids "
        "Approximation for Visual Servoing' (AROB 2015) give in simulation, by its method and by "
        "servoid's, and which of the constants that it leaves out matter?"
    ),
    settings=PaperStudySettings,
    quick=PaperStudySettings(
        map=QUICK_MAP,
        two=QUICK_TWO,
        servoing=quick_servoing(),
        sensitivity=quick_sensitivity(),
    ),
    plan=plan_paper,
    report=report_paper,
)

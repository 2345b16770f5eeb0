"""The trials of the study of tracking."""

from dataclasses import dataclass

from servoid._native import OneStepSettings, TrackSettings
from servoid.track import Method
from servoid.view.axes import DISTINCT
from servoid_experiments.design import Work
from servoid_experiments.sweeping import Factor, Series, cases_around, varied
from servoid_experiments.tracking.cases import Eyes, Scene, TrackCase
from servoid_experiments.tracking.settings import TrackStudySettings
from servoid_experiments.tracking.trial import TRACKING

WAY, HIDDEN, BASELINE, GENERATIONS = (
    "scene.way_mm",
    "scene.hidden",
    "scene.baseline_mm",
    "generations",
)


@dataclass(frozen=True)
class Plan:
    """The varied factors, and the series of cases in the centre.

    `ours` and `paper` are the trackers in the centre. `thorough` is servoid's with the largest
    number of generations in the sweep, if that exceeds the centre's, and is varied in `way_mm`.
    `other_eyes` are both trackers with the other direction of the eyes, and are varied in the
    baseline.
    """

    factors: tuple[Factor, ...]
    ours: Series[TrackCase]
    paper: Series[TrackCase]
    thorough: Series[TrackCase] | None
    other_eyes: tuple[Series[TrackCase], Series[TrackCase]]

    @property
    def series(self) -> list[Series[TrackCase]]:
        """Return all series."""
        thorough = [] if self.thorough is None else [self.thorough]
        return [self.ours, self.paper, *thorough, *self.other_eyes]

    def factors_of(self, series: Series[TrackCase]) -> list[Factor]:
        """Return the factors that are varied in a series."""
        if series in self.other_eyes:
            return [one for one in self.factors if one.key == BASELINE]
        if series is self.thorough:
            return [one for one in self.factors if one.key == WAY]
        if series is self.paper:
            return [one for one in self.factors if one.key != GENERATIONS]
        return list(self.factors)

    def cases(self) -> list[TrackCase]:
        """Return all cases; those that share a room, and within it a scene, are consecutive."""
        found: list[TrackCase] = []
        for series in self.series:
            found += cases_around(series.centers, self.factors_of(series))
        by_scene: dict[Scene, dict[TrackCase, None]] = {}
        for case in found:
            by_scene.setdefault(case.scene, {})[case] = None
        scenes = sorted(by_scene, key=lambda scene: scene.seed)
        return [case for scene in scenes for case in by_scene[scene]]


def plan_tracking(settings: TrackStudySettings) -> list[Work]:
    """Return the trials of the settings."""
    return [Work(TRACKING, layout(settings).cases())]


def layout(settings: TrackStudySettings) -> Plan:
    """Return the factors that the settings vary, and their centres."""
    ours = Series("servoid", DISTINCT[0], _centers(settings, Method.REGION))
    paper = Series("the paper's 1-step GA", DISTINCT[1], _centers(settings, Method.PAPER))
    own = ours.centers[0].generations
    most = max((*settings.sweep.generations, own))
    eyes = next(one for one in Eyes if one is not settings.center.eyes)
    return Plan(
        factors=factors_of(settings),
        ours=ours,
        paper=paper,
        thorough=_dashed(ours, GENERATIONS, most) if most > own else None,
        other_eyes=(_dashed(ours, "scene.eyes", eyes), _dashed(paper, "scene.eyes", eyes)),
    )


def factors_of(settings: TrackStudySettings) -> tuple[Factor, ...]:
    """Return the varied factors."""
    sweep = settings.sweep
    every = (
        Factor(WAY, "way between images", "mm", sweep.way_mm, log=True),
        Factor("population", "population", "", sweep.population, log=True),
        Factor(GENERATIONS, "generations an image", "", sweep.generations, log=True),
        Factor("ellipsoids", "ellipsoids", "", sweep.ellipsoids),
        Factor("scene.noise", "noise of the images", "grey levels", sweep.noise),
        Factor("scene.light", "light changes halfway", "times", sweep.light, log=True),
        Factor(HIDDEN, "hidden for a while", "share", sweep.hidden),
        Factor(BASELINE, "baseline of the eyes", "mm", sweep.baseline_mm, log=True),
        Factor("scene.object", "object", "", sweep.object),
    )
    return tuple(one for one in every if one.values)


def _centers(settings: TrackStudySettings, method: Method) -> tuple[TrackCase, ...]:
    center, own = settings.center, TrackSettings()
    is_paper = method is Method.PAPER
    population = OneStepSettings().population if is_paper else own.population
    return tuple(
        TrackCase(
            scene=Scene(
                object=center.object,
                way_mm=center.way_mm,
                noise=center.noise,
                light=center.light,
                hidden=center.hidden,
                baseline_mm=center.baseline_mm,
                eyes=center.eyes,
                images=settings.images,
                size_px=settings.size_px,
                seed=seed,
            ),
            method=method,
            population=center.population or population,
            generations=1 if is_paper else center.generations or own.generations,
            ellipsoids=center.ellipsoids,
        )
        for seed in range(settings.seeds)
    )


def _dashed(series: Series[TrackCase], key: str, value: int | Eyes) -> Series[TrackCase]:
    """Return a series with another value of one field."""
    centers = tuple(varied(center, key, value) for center in series.centers)
    return Series(series.name, series.color, centers, style="--")

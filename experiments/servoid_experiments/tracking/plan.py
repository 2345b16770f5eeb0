"""The settings of the study of tracking: factors, centre, every number, and the trials."""

from dataclasses import replace
from typing import Annotated

from msgspec import Struct
from msgspec.structs import asdict

from servoid._native import OneStepSettings, TrackSettings
from servoid.batch import Work
from servoid.sim.world.objects import OBJECTS
from servoid.track import Method
from servoid.view.axes import DISTINCT
from servoid_experiments.design import Count, NotNegative, Positive, about
from servoid_experiments.stage import EyeMode
from servoid_experiments.sweep import Factor, Series, check_names, check_varied, varied
from servoid_experiments.tracking.scene import Scene, Share
from servoid_experiments.tracking.trial import TRACKING, TrackCase

WAY, HIDDEN, BASELINE = "scene.way_mm", "scene.hidden", "scene.baseline_mm"
_GENERATIONS, _EYES = "generations", "scene.eyes"

Size = Annotated[tuple[Count, Count], about("width and height of an image")]


class CenterSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The case in the centre: factors that are not varied have these values."""

    object: Annotated[str, about("a shipped object")] = "bottle"
    way_mm: Annotated[Positive, about("of the object's middle from one image to the next")] = 12.0
    population: Annotated[
        Count | None, about("hypotheses a generation; none: each tracker's default")
    ] = None
    generations: Annotated[Count | None, about("an image; none: the tracker's default")] = None
    ellipsoids: Annotated[Count, about("of the body that is tracked")] = 5
    noise: Annotated[NotNegative, about("standard deviation of a pixel's noise in grey levels")] = (
        2.0
    )
    light: Annotated[Positive, about("what the light is multiplied by halfway")] = 1.0
    hidden: Annotated[Share, about("share of the object that is hidden in the third quarter")] = 0.0
    baseline_mm: Annotated[Positive, about("from eye to eye")] = 120.0
    eyes: Annotated[EyeMode, about("verged or parallel")] = EyeMode.VERGED

    def __post_init__(self) -> None:
        """Raise a StudyError if there is no such object."""
        check_names([self.object], OBJECTS)


class SweepSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The values of each factor, which are varied one at a time; empty: not varied."""

    way_mm: Annotated[tuple[Positive, ...], about("mm an image")] = (
        2.0, 5.0, 20.0, 30.0, 45.0, 60.0, 90.0,
    )  # fmt: skip
    population: Annotated[tuple[Count, ...], about("hypotheses a generation")] = (
        8, 16, 50, 100, 200,
    )  # fmt: skip
    generations: Annotated[tuple[Count, ...], about("an image")] = (2, 4, 8)
    ellipsoids: Annotated[tuple[Count, ...], about("of the body")] = (1, 2, 3, 8)
    noise: Annotated[tuple[NotNegative, ...], about("grey levels")] = (0.0, 6.0, 12.0, 24.0, 48.0)
    light: Annotated[tuple[Positive, ...], about("what it is multiplied by")] = (
        0.1, 0.2, 0.4, 0.7, 1.5, 2.5,
    )  # fmt: skip
    hidden: Annotated[tuple[Share, ...], about("share of the object")] = (0.25, 0.5, 0.75, 1.0)
    baseline_mm: Annotated[tuple[Positive, ...], about("mm, with eyes of both kinds")] = (
        20.0,
        60.0,
        240.0,
        400.0,
    )
    object: Annotated[tuple[str, ...], about("shipped objects")] = (
        "mug", "drill", "two_ellipsoids",
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Raise a StudyError if nothing is varied, or if there is no such object."""
        check_varied(self)
        check_names(self.object, OBJECTS)


class TrackStudySettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the study of tracking."""

    seeds: Annotated[int, about("scenes a case: paths, rooms, noise and searches", ge=1)] = 8
    images: Annotated[int, about("a scene", ge=12)] = 48
    size_px: Size = (320, 240)
    near: Annotated[
        float,
        about("ADD up to which a pose counts as right, in object diameters", gt=0.0),
    ] = 0.1
    center: CenterSettings = CenterSettings()
    sweep: SweepSettings = SweepSettings()


QUICK = TrackStudySettings(
    seeds=2,
    images=24,
    sweep=SweepSettings(
        way_mm=(30.0, 90.0),
        population=(8,),
        generations=(4,),
        ellipsoids=(1,),
        noise=(24.0,),
        light=(0.2,),
        hidden=(0.75,),
        baseline_mm=(30.0,),
        object=(),
    ),
)


def plan_tracking(settings: TrackStudySettings) -> list[Work]:
    """Return the trials; those that share a room, and within it a scene, are consecutive."""
    by_scene: dict[Scene, dict[TrackCase, None]] = {}
    for series in series_of(settings):
        for case in series.cases():
            by_scene.setdefault(case.scene, {})[case] = None
    scenes = sorted(by_scene, key=lambda scene: scene.seed)
    return [Work(TRACKING, [case for scene in scenes for case in by_scene[scene]])]


def series_of(settings: TrackStudySettings) -> list[Series[TrackCase]]:
    """Return both trackers in the centre, servoid's first, and dashed series of one factor.

    These are servoid's with the largest number of generations in the sweep, if that exceeds the
    centre's, over the way, and both with the other direction of the eyes, over the baseline.
    """
    factors = _factors(settings)
    ours = Series("servoid", DISTINCT[0], _centers(settings, Method.REGION), factors)
    paper = Series(
        "the paper's 1-step GA",
        DISTINCT[1],
        _centers(settings, Method.PAPER),
        tuple(one for one in factors if one.key != _GENERATIONS),
    )
    own = ours.centers[0].generations
    most = max((*settings.sweep.generations, own))
    eyes = next(one for one in EyeMode if one is not settings.center.eyes)
    more = [(ours, _GENERATIONS, most, WAY, f"dashed: {most} generations")] if most > own else []
    return [
        ours,
        paper,
        *(
            replace(
                one,
                centers=tuple(varied(center, key, value) for center in one.centers),
                factors=tuple(factor for factor in factors if factor.key == over),
                style="--",
                note=note,
            )
            for one, key, value, over, note in (
                *more,
                (ours, _EYES, eyes, BASELINE, f"dashed: {eyes.value} eyes"),
                (paper, _EYES, eyes, BASELINE, f"dashed: {eyes.value} eyes"),
            )
        ),
    ]


def _factors(settings: TrackStudySettings) -> tuple[Factor, ...]:
    """Return the varied factors."""
    sweep = settings.sweep
    every = (
        Factor(WAY, "way between images", "mm", sweep.way_mm, log=True),
        Factor("population", "population", "", sweep.population, log=True),
        Factor(_GENERATIONS, "generations an image", "", sweep.generations, log=True),
        Factor("ellipsoids", "ellipsoids", "", sweep.ellipsoids),
        Factor("scene.noise", "noise of the images", "grey levels", sweep.noise),
        Factor("scene.light", "light changes halfway", "times", sweep.light, log=True),
        Factor(HIDDEN, "hidden for a while", "share", sweep.hidden),
        Factor(BASELINE, "baseline of the eyes", "mm", sweep.baseline_mm, log=True),
        Factor("scene.object", "object", "", sweep.object),
    )
    return tuple(one for one in every if one.values)


def _centers(settings: TrackStudySettings, method: Method) -> tuple[TrackCase, ...]:
    own, is_paper = TrackSettings(), method is Method.PAPER
    population = OneStepSettings().population if is_paper else own.population
    center = asdict(settings.center)
    tracker = {
        "method": method,
        "population": center.pop("population") or population,
        "generations": center.pop("generations") or own.generations,
        "ellipsoids": center.pop("ellipsoids"),
    }
    if is_paper:
        tracker["generations"] = 1
    scene = {**center, "images": settings.images, "size_px": settings.size_px}
    return tuple(
        TrackCase(scene=Scene(**scene, seed=seed), **tracker) for seed in range(settings.seeds)
    )

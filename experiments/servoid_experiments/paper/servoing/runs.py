"""The runs of Section 5.3 of the paper, and of the future work that it names."""

from typing import Annotated

import msgspec
from msgspec import Meta

from servoid_experiments.design import Work
from servoid_experiments.paper.servoing.method import Method, TrackerKind
from servoid_experiments.paper.servoing.settings import Constants, Place, with_constant
from servoid_experiments.paper.servoing.trial import SERVOING, ServoingCase
from servoid_experiments.paper.servoing.unknown import UNKNOWN, UnknownCase

Count = Annotated[int, Meta(ge=1)]

SLOW, FAST = "the paper's method, slow", "the paper's method, fast"
OTHER = "the paper's method, fast, its other start"
REGION, SEARCH = "region term, not points", "population x 4, 4 generations an image"
FORWARD, BEST_NAME = "+ feed-forward", "+ joints by QP"
SURFACE = "the same with the surface term"

_SELDOM, _NARROW = 0.05, 0.0005  # mutation settings of a population that loses its diversity

_TRACKER = Method(tracker=TrackerKind.SERVOID)
_FILTERED = msgspec.structs.replace(_TRACKER, stamped=True, filtered=True)
_FORWARD = msgspec.structs.replace(_FILTERED, feed_forward=True)
BEST = msgspec.structs.replace(_FORWARD, qp=True)
_SIX = msgspec.structs.replace(BEST, turn_told=False, surface=True)


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """A change of the paper's method: its name and its settings.

    A population that is not `diverse` mutates rarely, and by little in the end.
    """

    name: str
    method: Method = Method()
    verging: bool = True
    times_population: int = 1
    times_generations: int = 1
    diverse: bool = True


# Other readings of the paper: estimates with timestamps, a population in the world's frame, and a
# population that has lost its diversity.
READINGS = (
    Change(name="in the hand, images stamped", method=Method(stamped=True)),
    Change(name="in the world, images stamped", method=Method(in_hand=False, stamped=True)),
    Change(name="in the hand, little diversity", diverse=False),
)

# First each change alone, replacing what the paper does; then all of them cumulatively.
ALONE = (
    Change(name="eyes parallel, not verging", verging=False),
    Change(name="population x 4", times_population=4),
    Change(name="4 generations an image", times_generations=4),
    Change(name=SEARCH, times_population=4, times_generations=4),
    Change(name=REGION, method=Method(tracker=TrackerKind.REGION)),
)
ADDED = (
    Change(
        name="region term, population x 4, 4 generations",
        method=Method(tracker=TrackerKind.REGION),
        times_population=4,
        times_generations=4,
    ),
    Change(name="servoid's tracker", method=_TRACKER),
    Change(name="+ filter, delay compensated", method=_FILTERED),
    Change(name=FORWARD, method=_FORWARD),
    Change(name=BEST_NAME, method=BEST),
    Change(name=SURFACE, method=msgspec.structs.replace(BEST, surface=True)),
)


class UnknownSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Runs with servoid's method in which only the object's first mask is given."""

    objects: Annotated[
        tuple[str, ...], Meta(description="with a pattern, which the surface term follows")
    ] = ("painted_ellipsoid", "bottle", "mug")
    plain_objects: Annotated[
        tuple[str, ...], Meta(description="of one colour, followed by their outlines alone")
    ] = ("two_ellipsoids",)
    ellipsoids: Annotated[int, Meta(ge=1, description="at most, of a body")] = 5
    seeds: Annotated[Count, Meta(description="runs of each object")] = 2
    size_px: Annotated[tuple[int, int], Meta(description="width and height of an image")] = (
        480,
        360,
    )
    settle_s: Annotated[float, Meta(ge=0, description="of motion that is not measured, s")] = 3.0


class ServoingSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's servoing, changes to it and the future work; all lengths in metres."""

    omegas: Annotated[
        tuple[float, float],
        Meta(description="of the object's slow and its fast motion, rad/s (Sec. 5.3)"),
    ] = (0.209, 0.628)
    constants: Constants = Constants()
    seeds: Annotated[Count, Meta(description="runs of the paper's method at either speed")] = 5
    periods: Annotated[
        tuple[Count, Count], Meta(description="that are measured of the slow and the fast motion")
    ] = (1, 3)
    settle_s: Annotated[float, Meta(ge=0, description="of motion that is not measured, s")] = 5.0
    other_seeds: Annotated[
        Count, Meta(description="runs with the other of the paper's two statements of the start")
    ] = 2
    reading_seeds: Annotated[
        Count, Meta(description="runs of each other reading of the paper's method")
    ] = 3
    cure_seeds: Annotated[Count, Meta(description="runs of each change")] = 3
    cure_settle_s: Annotated[
        float, Meta(ge=0, description="of their motion that is not measured, s")
    ] = 3.0
    unknown: UnknownSettings = UnknownSettings()


def quick_servoing() -> ServoingSettings:
    """Return settings of a study that takes seconds and only tests that everything runs."""
    given = with_constant(Constants(), "scene.amplitude", 0.02)
    return ServoingSettings(
        omegas=(2.0, 4.0),
        seeds=1,
        periods=(1, 1),
        settle_s=0.5,
        other_seeds=1,
        reading_seeds=1,
        cure_seeds=1,
        cure_settle_s=0.5,
        constants=with_constant(given, "scene.rest_s", 0.3),
        unknown=UnknownSettings(objects=(), plain_objects=()),
    )


def servoing_work(settings: ServoingSettings) -> list[Work]:
    """Return the runs: the paper's, those with changes, and those with unknown objects."""
    cases = [*_paper_cases(settings), *_change_cases(settings), *_several_cases(settings)]
    unknown = _unknown_cases(settings)
    return [Work(SERVOING, cases), *([Work(UNKNOWN, unknown)] if unknown else [])]


def _paper_cases(settings: ServoingSettings) -> list[ServoingCase]:
    """Return the paper's runs at both speeds, and other readings of the fast one."""
    given = settings.constants
    place = Place.PRINTED if given.scene.place is Place.TEXT else Place.TEXT
    other = with_constant(given, "scene.place", place)
    slow, fast = zip(settings.omegas, settings.periods, strict=True)
    return [
        ServoingCase(
            name=name,
            seed=seed,
            omega=omega,
            settle_s=settings.settle_s,
            periods=periods,
            method=method,
            constants=constants,
        )
        for name, (omega, periods), method, constants, seeds in (
            (SLOW, slow, Method(), given, settings.seeds),
            (FAST, fast, Method(), given, settings.seeds),
            (OTHER, fast, Method(), other, settings.other_seeds),
            *(
                (one.name, fast, one.method, _bred(one, given), settings.reading_seeds)
                for one in READINGS
            ),
        )
        for seed in range(seeds)
    ]


def _bred(change: Change, given: Constants) -> Constants:
    """Return constants with a change's settings of the population's diversity."""
    if change.diverse:
        return given
    return with_constant(
        with_constant(given, "search.mutation_rate", _SELDOM), "search.least_width", _NARROW
    )


def _change_cases(settings: ServoingSettings) -> list[ServoingCase]:
    """Return the runs of the changes, at the fast speed."""
    cases = []
    for change in (*ALONE, *ADDED):
        search = settings.constants.search
        given = with_constant(settings.constants, "eyes.verging", change.verging)
        for key, times in (
            ("population", change.times_population),
            ("generations", change.times_generations),
        ):
            given = with_constant(given, f"search.{key}", times * getattr(search, key))
        cases += [
            _changed(settings, seed, given, change.method, name=change.name)
            for seed in range(settings.cure_seeds)
        ]
    return cases


SEVERAL = "two ellipsoids, the paper's method"
SEVERAL_BEST = "two ellipsoids, servoid's method"
SIX_BEST = "painted ellipsoid, servoid's method, six degrees of freedom"


def _several_cases(settings: ServoingSettings) -> list[ServoingCase]:
    """Return runs to other known bodies: of two ellipsoids, and with estimated rotation."""
    kinds = (
        (SEVERAL, "two_ellipsoids", Method()),
        (SEVERAL_BEST, "two_ellipsoids", BEST),
        (SIX_BEST, "painted_ellipsoid", _SIX),
    )
    return [
        _changed(settings, seed, settings.constants, method, name=name, kind=kind)
        for name, kind, method in kinds
        for seed in range(settings.unknown.seeds)
    ]


def _changed(
    settings: ServoingSettings,
    seed: int,
    given: Constants,
    method: Method,
    *,
    name: str,
    kind: str = "ellipsoid",
) -> ServoingCase:
    """Return a run at the fast speed, with one kind of object."""
    return ServoingCase(
        name=name,
        seed=seed,
        omega=settings.omegas[1],
        settle_s=settings.cure_settle_s,
        periods=1,
        object=kind,
        method=method,
        constants=given,
    )


def _unknown_cases(settings: ServoingSettings) -> list[UnknownCase]:
    unknown, scene = settings.unknown, settings.constants.scene
    return [
        UnknownCase(
            object=name,
            seed=seed,
            ellipsoids=unknown.ellipsoids,
            surface=name in unknown.objects,
            omega=settings.omegas[1],
            amplitude=scene.amplitude,
            settle_s=unknown.settle_s,
            periods=1,
            size_px=unknown.size_px,
            background=scene.background,
        )
        for name in (*unknown.plain_objects, *unknown.objects)
        for seed in range(unknown.seeds)
    ]

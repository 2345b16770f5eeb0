"""The runs of Section 5.3 of the paper, and of the future work that it names."""

from dataclasses import dataclass, field
from typing import Annotated, Any

import msgspec
from msgspec.structs import replace

from servoid.batch import Work
from servoid_experiments.design import Count, about
from servoid_experiments.paper.servoing.method import Method, TrackerKind
from servoid_experiments.paper.servoing.settings import Constants, Place, Settle, with_constant
from servoid_experiments.paper.servoing.trial import SERVOING, ServoingCase
from servoid_experiments.paper.servoing.unknown import UNKNOWN, UnknownCase

SLOW, FAST = "the paper's method, slow", "the paper's method, fast"
OTHER = "the paper's method, fast, its other start"
REGION, SEARCH = "region term, not points", "population x 4, 4 generations an image"
FORWARD, BEST_NAME = "+ feed-forward", "+ joints by QP"
SURFACE = "the same with the surface term"
SEVERAL = "two ellipsoids, the paper's method"
SEVERAL_BEST = "two ellipsoids, servoid's method"
SIX_BEST = "painted ellipsoid, servoid's method, six degrees of freedom"

_TRACKER = Method(tracker=TrackerKind.SERVOID)
_FILTERED = replace(_TRACKER, stamped=True, filtered=True)
_FORWARD = replace(_FILTERED, feed_forward=True)
BEST = replace(_FORWARD, qp=True)
_SIX = replace(BEST, turn_told=False, surface=True)


@dataclass(frozen=True)
class Change:
    """A change of the paper's method, by its name.

    `constants` are other values by dotted names, `times` factors on those of the search.
    """

    name: str
    method: Method = field(default_factory=Method)
    constants: dict[str, Any] = field(default_factory=dict)
    times: dict[str, int] = field(default_factory=dict)
    object: str = "ellipsoid"

    def applied(self, given: Constants) -> Constants:
        """Return constants with the change."""
        for name, value in self.constants.items():
            given = with_constant(given, name, value)
        for key, times in self.times.items():
            given = with_constant(given, f"search.{key}", times * getattr(given.search, key))
        return given


_LARGER, _LONGER = {"population": 4}, {"generations": 4}
_ALIKE = {"search.mutation_rate": 0.05, "search.least_width": 0.0005}  # it loses its diversity
_REGION = Method(tracker=TrackerKind.REGION)

# Other readings of the paper: estimates with timestamps, a population in the world's frame, and a
# population that has lost its diversity.
READINGS = (
    Change("in the hand, images stamped", Method(stamped=True)),
    Change("in the world, images stamped", Method(in_hand=False, stamped=True)),
    Change("in the hand, little diversity", constants=_ALIKE),
)

# First each change alone, replacing what the paper does; then all of them cumulatively.
ALONE = (
    Change("eyes parallel, not verging", constants={"eyes.verging": False}),
    Change("population x 4", times=_LARGER),
    Change("4 generations an image", times=_LONGER),
    Change(SEARCH, times=_LARGER | _LONGER),
    Change(REGION, _REGION),
)
ADDED = (
    Change("region term, population x 4, 4 generations", _REGION, times=_LARGER | _LONGER),
    Change("servoid's tracker", _TRACKER),
    Change("+ filter, delay compensated", _FILTERED),
    Change(FORWARD, _FORWARD),
    Change(BEST_NAME, BEST),
    Change(SURFACE, replace(BEST, surface=True)),
)
# Other known bodies: of two ellipsoids, and with estimated rotation.
OTHERS = (
    Change(SEVERAL, object="two_ellipsoids"),
    Change(SEVERAL_BEST, BEST, object="two_ellipsoids"),
    Change(SIX_BEST, _SIX, object="painted_ellipsoid"),
)


class UnknownSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Runs with servoid's method in which only the object's first mask is given."""

    objects: Annotated[tuple[str, ...], about("with a pattern, which the surface term follows")] = (
        "painted_ellipsoid",
        "bottle",
        "mug",
    )
    plain_objects: Annotated[
        tuple[str, ...], about("of one colour, followed by their outlines alone")
    ] = ("two_ellipsoids",)
    ellipsoids: Annotated[int, about("at most, of a body", ge=1)] = 5
    seeds: Annotated[Count, about("runs of each object")] = 2
    size_px: Annotated[tuple[int, int], about("width and height of an image")] = (480, 360)
    settle_s: Settle = 3.0


class ServoingSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's servoing, changes to it and the future work; all lengths in metres."""

    omegas: Annotated[
        tuple[float, float],
        about("of the object's slow and its fast motion, rad/s (Sec. 5.3)"),
    ] = (0.209, 0.628)
    constants: Constants = Constants()
    seeds: Annotated[Count, about("runs of the paper's method at either speed")] = 5
    periods: Annotated[
        tuple[Count, Count], about("that are measured of the slow and the fast motion")
    ] = (1, 3)
    settle_s: Settle = 5.0
    other_seeds: Annotated[
        Count, about("runs with the other of the paper's two statements of the start")
    ] = 2
    reading_seeds: Annotated[Count, about("runs of each other reading of the paper's method")] = 3
    cure_seeds: Annotated[Count, about("runs of each change")] = 3
    cure_settle_s: Annotated[float, about("of their motion that is not measured, s", ge=0)] = 3.0
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
    given, settle_s = settings.constants, settings.settle_s
    place = Place.PRINTED if given.scene.place is Place.TEXT else Place.TEXT
    slow, fast = zip(settings.omegas, settings.periods, strict=True)
    verging = with_constant(given, "eyes.verging", True)
    once, cure_settle_s = (fast[0], 1), settings.cure_settle_s
    runs = [
        (Change(SLOW), given, slow, settle_s, settings.seeds),
        (Change(FAST), given, fast, settle_s, settings.seeds),
        (Change(OTHER, constants={"scene.place": place}), given, fast, settle_s,
         settings.other_seeds),
        *((one, given, fast, settle_s, settings.reading_seeds) for one in READINGS),
        *((one, verging, once, cure_settle_s, settings.cure_seeds) for one in (*ALONE, *ADDED)),
        *((one, given, once, cure_settle_s, settings.unknown.seeds) for one in OTHERS),
    ]  # fmt: skip
    cases = [
        ServoingCase(
            name=change.name,
            seed=seed,
            omega=omega,
            settle_s=settled_s,
            periods=periods,
            object=change.object,
            method=change.method,
            constants=change.applied(constants),
        )
        for change, constants, (omega, periods), settled_s, seeds in runs
        for seed in range(seeds)
    ]
    unknown = _unknown_cases(settings)
    return [Work(SERVOING, cases), *([Work(UNKNOWN, unknown)] if unknown else [])]


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

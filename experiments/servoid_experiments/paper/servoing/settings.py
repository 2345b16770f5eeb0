"""All settings of the paper's servoing: those that it states, and those that are assumed.

The description of each field ends with its source in brackets: a place in the paper, the lab's
papers, or `assumed`. `constants` parses these.
"""

import re
from collections.abc import Iterator
from enum import Enum
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from servoid_experiments.design import Positive

_SOURCED = re.compile(r"(?P<says>.*) \((?P<source>(?:[^()]|\([^()]*\))*)\)")

Triple = tuple[float, float, float]
Seven = tuple[float, float, float, float, float, float, float]
Omega = Annotated[float, Meta(gt=0, description="of the object's motion, rad/s")]
Settle = Annotated[float, Meta(ge=0, description="of motion that is not measured, s")]
Periods = Annotated[int, Meta(ge=1, description="whole ones that are measured")]


class Place(Enum):
    """Which of the paper's two statements about the object's position is used.

    The printed matrix puts it 100 mm to the left of the hand and at its height, the text 90 mm
    above the hand's middle, where the goal is.
    """

    TEXT = "text"
    PRINTED = "printed"


def _above(what: str, **bounds: Any) -> Meta:
    return Meta(gt=0, description=what, **bounds)


def _from_0(what: str, **bounds: Any) -> Meta:
    return Meta(ge=0, description=what, **bounds)


class Scene(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The object, its position and its motion."""

    world_from_hand: Annotated[
        Seven, Meta(description="hand at the start: w, x, y, z, tx, ty, tz in m (Eq. (17))")
    ] = (0.5, -0.5, -0.5, 0.5, -0.89, 0.0, 0.5)
    place: Annotated[
        Place,
        Meta(description="text: object where it is wanted; printed: by its matrix (Sec. 5.3)"),
    ] = Place.TEXT
    printed_place: Annotated[
        Triple, Meta(description="object in the world by the printed matrix, m (Eq. (18))")
    ] = (-1.435, -0.1, 0.5)
    amplitude: Annotated[
        float, _above("A of the object's motion A - A cos wt along its x, m (Eq. (19))")
    ] = 0.15
    goal: Annotated[Triple, Meta(description="object wanted in the hand's frame, m (Eq. (20))")] = (
        0.0,
        -0.09,
        0.545,
    )
    radii: Annotated[
        tuple[Positive, Positive, Positive],
        Meta(
            description="of the object, m: 90 and 45 mm as diameters, the long axis upright "
            "(assumed)"
        ),
    ] = (0.0225, 0.045, 0.0225)
    background: Annotated[
        str, Meta(description="behind the object: plain or cluttered (assumed)")
    ] = "plain"
    rest_s: Annotated[
        float, _from_0("before the object moves, in which the hand settles, s (assumed)")
    ] = 1.0


class Eyes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two cameras in the hand."""

    verging: Annotated[
        bool, Meta(description="eyes turn to the object, or look straight on (Sec. 4)")
    ] = True
    half_baseline: Annotated[float, _above("half the distance of the eyes, m (lab's papers)")] = (
        0.12
    )
    size_px: Annotated[
        tuple[int, int], Meta(description="width and height of an image, px (assumed)")
    ] = (320, 240)
    sight_deg: Annotated[
        float, Meta(gt=0, lt=180, description="angle over an image's width, degrees (assumed)")
    ] = 50.0
    rate_hz: Annotated[float, _above("images each second, Hz (assumed)")] = 30.0
    latency_s: Annotated[float, _from_0("from an exposure to its image's arrival, s (assumed)")] = (
        0.04
    )
    noise: Annotated[float, _from_0("of an image, grey levels (assumed)")] = 1.5
    gaze_gain: Annotated[float, _above("of the angles of the eyes, 1/s (assumed)")] = 12.0
    gaze_rate_gain: Annotated[float, _from_0("of the rates of these angles (assumed)")] = 0.1


class Arm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The arm, a Mitsubishi PA-10 of seven joints."""

    links: Annotated[str, Meta(description="set of link lengths: openbionics or jsi (assumed)")] = (
        "openbionics"
    )
    lag_s: Annotated[float, _above("of the joints' speed servos, s (assumed)")] = 0.02
    period_s: Annotated[float, _above("control period, s (assumed)", le=0.25)] = 0.008


class Search(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The genetic algorithm whose population lives from image to image."""

    generations: Annotated[int, Meta(ge=1, description="an image (Sec. 3.2)")] = 1
    population: Annotated[int, Meta(ge=2, description="individuals (assumed)")] = 60
    elites: Annotated[int, Meta(ge=1, description="that live on unchanged (assumed)")] = 4
    points: Annotated[
        int, Meta(ge=4, description="m: on the surface, and on its envelope (assumed)")
    ] = 200
    alpha: Annotated[
        float, _above("envelope's margin as a share of the smallest radius (assumed)")
    ] = 0.3
    reach: Annotated[
        float, _above("range of a gene to each side, in lengths of the object (assumed)")
    ] = 0.4
    mutation_rate: Annotated[
        float, Meta(ge=0, le=1, description="share of genes that mutate (assumed)")
    ] = 0.3
    mutation_width: Annotated[
        float, _above("of a mutation at first, as a share of the gene's range (assumed)")
    ] = 0.1
    least_width: Annotated[
        float, _above("to which success narrows a mutation, the same share (assumed)")
    ] = 0.03


class Law(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The hand's control law."""

    position_gain: Annotated[float, _above("K_Pp in Eq. (12), 1/s (assumed)")] = 4.0
    position_rate_gain: Annotated[float, _from_0("K_Vp in Eq. (12) (assumed)")] = 0.1
    turn_gain: Annotated[float, _above("K_Po in Eq. (13), 1/s (assumed)")] = 8.0
    turn_rate_gain: Annotated[float, _from_0("K_Vo in Eq. (13) (assumed)")] = 0.1
    joint_gain: Annotated[float, _from_0("k_p in Eq. (16), 1/s (assumed)")] = 1.0
    speed: Annotated[float, _above("fastest hand, m/s (assumed)")] = 0.5
    acceleration: Annotated[float, _above("of the hand, m/s² (assumed)")] = 2.0


class Constants(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All numbers of the paper's servoing."""

    scene: Scene = Scene()
    eyes: Eyes = Eyes()
    arm: Arm = Arm()
    search: Search = Search()
    law: Law = Law()


def constants(settings: msgspec.Struct) -> list[tuple[str, str, str, str]]:
    """List the dotted name, value, meaning and source of each constant inside settings.

    Fields whose descriptions do not end with a source in brackets are left out.
    """
    return list(_constants(settings, ""))


def _constants(settings: msgspec.Struct, place: str) -> Iterator[tuple[str, str, str, str]]:
    kinds = get_type_hints(type(settings), include_extras=True)
    for name in settings.__struct_fields__:
        value = getattr(settings, name)
        if isinstance(value, msgspec.Struct):
            yield from _constants(value, f"{place}{name}.")
        elif get_origin(kinds[name]) is Annotated:
            described = [
                part.description for part in get_args(kinds[name]) if isinstance(part, Meta)
            ]
            found = _SOURCED.fullmatch("".join(text for text in described if text))
            if found:
                yield f"{place}{name}", _written(value), found["says"], found["source"]


def _written(value: Any) -> str:
    if isinstance(value, Enum):
        return str(value.value)
    if isinstance(value, tuple):
        return ", ".join(_written(part) for part in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def with_constant(settings: Constants, name: str, value: Any) -> Constants:
    """Return constants with another value of the one with a dotted name, checked."""
    table, key = name.split(".")
    part = msgspec.structs.replace(getattr(settings, table), **{key: value})
    changed = msgspec.structs.replace(settings, **{table: part})
    return msgspec.convert(msgspec.to_builtins(changed), Constants, strict=False)

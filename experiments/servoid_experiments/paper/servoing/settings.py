"""All settings of the paper's servoing: those that it states, and those that are assumed.

The description of each field ends with its source in brackets: a place in the paper, the lab's
papers, or `assumed`. `constants` parses these.
"""

import re
from enum import Enum
from typing import Annotated, Any, get_args, get_type_hints

import msgspec
from msgspec import Meta

from servoid_experiments.design import NotNegative, Positive, about

_SOURCED = re.compile(r"(?P<says>.*) \((?P<source>(?:[^()]|\([^()]*\))*)\)")

Triple = tuple[float, float, float]
Seven = tuple[float, float, float, float, float, float, float]
Omega = Annotated[float, about("of the object's motion, rad/s", gt=0)]
Settle = Annotated[float, about("of motion that is not measured, s", ge=0)]
Periods = Annotated[int, about("whole ones that are measured", ge=1)]


class Place(Enum):
    """Which of the paper's two statements about the object's position is used.

    The printed matrix puts it 100 mm to the left of the hand and at its height, the text 90 mm
    above the hand's middle, where the goal is.
    """

    TEXT = "text"
    PRINTED = "printed"


class Scene(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The object, its position and its motion."""

    world_from_hand: Annotated[
        Seven, about("hand at the start: w, x, y, z, tx, ty, tz in m (Eq. (17))")
    ] = (0.5, -0.5, -0.5, 0.5, -0.89, 0.0, 0.5)
    place: Annotated[
        Place,
        about("text: object where it is wanted; printed: by its matrix (Sec. 5.3)"),
    ] = Place.TEXT
    printed_place: Annotated[
        Triple, about("object in the world by the printed matrix, m (Eq. (18))")
    ] = (-1.435, -0.1, 0.5)
    amplitude: Annotated[
        Positive, about("A of the object's motion A - A cos wt along its x, m (Eq. (19))")
    ] = 0.15
    goal: Annotated[Triple, about("object wanted in the hand's frame, m (Eq. (20))")] = (
        0.0,
        -0.09,
        0.545,
    )
    radii: Annotated[
        tuple[Positive, Positive, Positive],
        about("of the object, m: 90 and 45 mm as diameters, the long axis upright (assumed)"),
    ] = (0.0225, 0.045, 0.0225)
    background: Annotated[str, about("behind the object: plain or cluttered (assumed)")] = "plain"
    rest_s: Annotated[
        NotNegative, about("before the object moves, in which the hand settles, s (assumed)")
    ] = 1.0


class Eyes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The two cameras in the hand."""

    verging: Annotated[bool, about("eyes turn to the object, or look straight on (Sec. 4)")] = True
    half_baseline: Annotated[Positive, about("half the distance of the eyes, m (lab's papers)")] = (
        0.12
    )
    size_px: Annotated[tuple[int, int], about("width and height of an image, px (assumed)")] = (
        320,
        240,
    )
    sight_deg: Annotated[
        float, about("angle over an image's width, degrees (assumed)", gt=0, lt=180)
    ] = 50.0
    rate_hz: Annotated[Positive, about("images each second, Hz (assumed)")] = 30.0
    latency_s: Annotated[
        NotNegative, about("from an exposure to its image's arrival, s (assumed)")
    ] = 0.04
    noise: Annotated[NotNegative, about("of an image, grey levels (assumed)")] = 1.5
    gaze_gain: Annotated[Positive, about("of the angles of the eyes, 1/s (assumed)")] = 12.0
    gaze_rate_gain: Annotated[NotNegative, about("of the rates of these angles (assumed)")] = 0.1


class Arm(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The arm, a Mitsubishi PA-10 of seven joints."""

    links: Annotated[str, about("set of link lengths: openbionics or jsi (assumed)")] = (
        "openbionics"
    )
    lag_s: Annotated[Positive, about("of the joints' speed servos, s (assumed)")] = 0.02
    period_s: Annotated[Positive, about("control period, s (assumed)", le=0.25)] = 0.008


class Search(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The genetic algorithm whose population lives from image to image."""

    generations: Annotated[int, about("an image (Sec. 3.2)", ge=1)] = 1
    population: Annotated[int, about("individuals (assumed)", ge=2)] = 60
    elites: Annotated[int, about("that live on unchanged (assumed)", ge=1)] = 4
    points: Annotated[int, about("m: on the surface, and on its envelope (assumed)", ge=4)] = 200
    alpha: Annotated[
        Positive, about("envelope's margin as a share of the smallest radius (assumed)")
    ] = 0.3
    reach: Annotated[
        Positive, about("range of a gene to each side, in lengths of the object (assumed)")
    ] = 0.4
    mutation_rate: Annotated[float, about("share of genes that mutate (assumed)", ge=0, le=1)] = 0.3
    mutation_width: Annotated[
        Positive, about("of a mutation at first, as a share of the gene's range (assumed)")
    ] = 0.1
    least_width: Annotated[
        Positive, about("to which success narrows a mutation, the same share (assumed)")
    ] = 0.03


class Law(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The hand's control law."""

    position_gain: Annotated[Positive, about("K_Pp in Eq. (12), 1/s (assumed)")] = 4.0
    position_rate_gain: Annotated[NotNegative, about("K_Vp in Eq. (12) (assumed)")] = 0.1
    turn_gain: Annotated[Positive, about("K_Po in Eq. (13), 1/s (assumed)")] = 8.0
    turn_rate_gain: Annotated[NotNegative, about("K_Vo in Eq. (13) (assumed)")] = 0.1
    joint_gain: Annotated[NotNegative, about("k_p in Eq. (16), 1/s (assumed)")] = 1.0
    speed: Annotated[Positive, about("fastest hand, m/s (assumed)")] = 0.5
    acceleration: Annotated[Positive, about("of the hand, m/s² (assumed)")] = 2.0


class Constants(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All numbers of the paper's servoing."""

    scene: Scene = Scene()
    eyes: Eyes = Eyes()
    arm: Arm = Arm()
    search: Search = Search()
    law: Law = Law()


def constants(settings: Constants) -> list[tuple[str, str, str, str]]:
    """List the dotted name, value, meaning and source of each constant."""
    found = []
    for table in settings.__struct_fields__:
        part = getattr(settings, table)
        for key, kind in get_type_hints(type(part), include_extras=True).items():
            described = [one.description for one in get_args(kind) if isinstance(one, Meta)]
            text = _SOURCED.fullmatch("".join(filter(None, described)))
            assert text is not None, f"{table}.{key} has no source"
            found.append((f"{table}.{key}", _written(getattr(part, key)), *text.group(1, 2)))
    return found


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

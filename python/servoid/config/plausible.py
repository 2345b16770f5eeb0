"""The largest lengths, angles and times that are plausible; larger ones are in another unit."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

from servoid.words import digits, measured

OBJECT_LEAST_M, OBJECT_MOST_M = 1e-3, 10.0
"""The sizes of objects: others are reported, as their unit may be any."""

MODELLED_AWAY_M, MODELLED_SIZE_M = (0.02, 20.0), (2e-3, 5.0)
"""The distances and sizes of objects to model: others are doubted, as of lengths in centimetres."""

SENSED_AWAY_M, SENSED_SIZE_M = 10.0, 3.0
"""The same, at most, of objects that a depth camera measures: it sees a few metres far."""

FAR_M = 100.0
"""The distance from cameras to what they measure, and from an arm to where it may go."""

WORLD_M = 1e4
"""Coordinates in the world, whose origin may be far from the arm."""

NEAR_M = 10.0
"""Offsets between what is mounted on an arm or a rig, such as a tool or two cameras, and between a
hand and an object that it follows."""

REACH_M = 50.0
"""The length of an arm."""

SQUARE_M = 1.0
"""The side of a square on a printed board."""

HAND_SPEED = 20.0
"""The speed of a hand, in m/s: no arm is faster."""

OBJECT_SPEED = 100.0
"""The speed of an object beside an arm, in m/s."""

BRAKING = 500.0
"""The acceleration at which an arm brakes, in m/s²."""

TURN = 4.0 * math.pi
"""The farthest limit of a joint, in rad; what turns without an end has none."""

TURN_SPEED = 10.0 * math.pi
"""The speed limit of a joint, in rad/s: the fastest wrists of robots reach it."""

PERIOD_S = 0.5
"""The control period of an arm: it is held after `safety.coast_s` without images, 0.25 s."""

_PER_RAD = math.degrees(1.0)
_QUANTITIES = {
    "m": ("lengths", "metres", "millimetres", 1000.0),
    "m/s": ("speeds", "metres per second", "millimetres per second", 1000.0),
    "m/s²": (
        "accelerations",
        "metres per second squared",
        "millimetres per second squared",
        1000.0,
    ),
    "rad": ("angles", "radians", "degrees", _PER_RAD),
    "rad/s": ("speeds of joints", "radians per second", "degrees per second", _PER_RAD),
    "s": ("times", "seconds", "milliseconds", 1000.0),
}


@dataclass(frozen=True)
class Most:
    """Annotates a setting whose numbers are lengths, or speeds, of at most so much.

    Numbers of a unit quaternion beside the lengths are always smaller.
    """

    most: float
    unit: str = "m"


def implausible(name: str, value: float, most: float, unit: str = "m") -> str | None:
    """Return the message that refuses a quantity that is not plausible in its unit, else None."""
    if not math.isfinite(value) or abs(value) <= most:
        return None
    quantities, usual, small, count = _QUANTITIES[unit]
    return (
        f"{name} is {digits(value)} {unit}, and more than {digits(most)} {unit} is not plausible; "
        f"{quantities} are in {usual}: if it is in {small}, write {digits(value / count)}"
    )


def distance_fault(name: str, distance_m: float | None) -> str | None:
    """Return the message that refuses the distance of an object, if one is given, else None."""
    if distance_m is None:
        return None
    if not 0.0 < distance_m < math.inf:
        return f"{name} is {digits(distance_m)}; give a positive number of metres, such as 0.6"
    return implausible(name, distance_m, FAR_M)


def implausible_setting(name: str, value: Any, kind: Any) -> str | None:
    """Return the message that refuses a setting whose type has a `Most`, else None."""
    limits = [part for part in get_args(kind)[1:] if isinstance(part, Most)]
    if get_origin(kind) is not Annotated or not limits:
        return None
    faults = (implausible(name, one, limits[0].most, limits[0].unit) for one in _numbers(value))
    return next((fault for fault in faults if fault is not None), None)


def size_note(what: str, sides_m: Iterable[float]) -> str | None:
    """Report an object of a size that hardly any has; `what` names it, such as `the mesh`.

    Its size is the longest of `sides_m`, those of the box around it along its own axes.
    """
    size_m = float(max(sides_m))
    if size_m > OBJECT_MOST_M:
        cure = "if its unit is the millimetre, scale it by 0.001, as model --unit does"
    elif size_m < OBJECT_LEAST_M:
        cure = "if its unit is the kilometre or the inch, scale it by 1000 or 0.0254"
    else:
        return None
    return f"{what} is {measured(size_m)} m large; {cure}"


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, (list, tuple)):
        for one in value:
            yield from _numbers(one)
    elif isinstance(value, (int, float)):
        yield value

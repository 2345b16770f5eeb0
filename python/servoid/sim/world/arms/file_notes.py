"""Notes on what an arm's file leaves out, and on what is probably in another unit."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from servoid.config import TURN, TURN_SPEED, implausible
from servoid.sim.world.arms.urdf import Urdf
from servoid.sim.world.settings import ArmSettings
from servoid.words import digits, measured

ENDLESS = 2.0 * math.pi
"""The range of a joint without limits to each side, in rad."""

TINY = math.radians(TURN)
"""The largest limit, in rad, of those in radians that are read as degrees."""


def mjcf_notes(settings: ArmSettings, model: Any, joints: Sequence[str]) -> Iterator[str]:
    """Yield notes on driven joints of an MJCF that have no range, or ranges as if in radians."""
    name = Path(settings.name).name
    places = {joint: model.joint(joint).id for joint in joints}
    free = [joint for joint, place in places.items() if not model.jnt_limited[place]]
    if free:
        yield (
            f"{name} gives {', '.join(free)} no range, so that they turn by 360 degrees to each "
            "side in this world; write the ranges of the data sheet into the file"
        )
    limited = [joint for joint in joints if joint not in free]
    most = max((float(abs(model.jnt_range[places[one]]).max()) for one in limited), default=0.0)
    if limited and most <= TINY:
        yield (
            f"the joints of {name} turn by at most {measured(math.degrees(most))} degrees: are "
            'their ranges in radians? Then write <compiler angle="radian"/>, as MJCF files are in '
            "degrees otherwise"
        )


def urdf_notes(settings: ArmSettings, urdf: Urdf, joints: Sequence[str]) -> Iterator[str]:
    """Yield notes on driven joints of a URDF without limits of torque or speed, or absurd ones."""
    name = Path(settings.name).name
    free = [joint for joint in joints if joint in urdf.effortless]
    if free:
        yield (
            f"{name} gives {', '.join(free)} no effort, or 0: their torque is not limited "
            "in this world; write the efforts of the data sheet into the file"
        )
    free = [joint for joint in joints if joint not in urdf.speeds]
    if free:
        yield (
            f"{name} gives {', '.join(free)} no velocity, or 0: they turn by at most "
            f"{digits(settings.speed)} rad/s, which is arm.speed; write the velocities of the data "
            "sheet into the file"
        )
    for joint in joints:
        speed = urdf.speeds.get(joint, 0.0)
        absurd = implausible(f"the velocity of {joint} in {name}", speed, TURN_SPEED, "rad/s")
        if absurd is not None:
            yield f"{absurd}; at most it turns by {digits(settings.speed)} rad/s, as of arm.speed"

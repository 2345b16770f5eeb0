"""Captures of an object that servoid makes itself, to try everything on."""

from servoid.sim.motion import WHOLE_TURN
from servoid.sim.moving import write_moving_sample
from servoid.sim.sample import write_sample
from servoid.sim.scene import Look, MovingScene, Scenario

__all__ = [
    "WHOLE_TURN",
    "Look",
    "MovingScene",
    "Scenario",
    "write_moving_sample",
    "write_sample",
]

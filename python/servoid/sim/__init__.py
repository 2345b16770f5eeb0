"""Rendered captures of objects, to try servoid without data of one's own."""

from servoid.sim.samples.motion import WHOLE_TURN
from servoid.sim.samples.moving import write_moving_sample
from servoid.sim.samples.sample import write_sample
from servoid.sim.samples.scene import Look, MovingScene, Scenario

__all__ = [
    "WHOLE_TURN",
    "Look",
    "MovingScene",
    "Scenario",
    "write_moving_sample",
    "write_sample",
]

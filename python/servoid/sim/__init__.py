"""Captures of an object that servoid makes itself, to try everything on."""

from servoid.sim.moving import write_moving_sample
from servoid.sim.sample import write_sample
from servoid.sim.scene import Look, MovingScene, Scenario

__all__ = ["Look", "MovingScene", "Scenario", "write_moving_sample", "write_sample"]

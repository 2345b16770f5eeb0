"""Rendered captures of objects, and an arm without physics, to try servoid without one's own."""

from servoid.sim.accuracy import median_add_m
from servoid.sim.arm_file import read_arm
from servoid.sim.samples import snail
from servoid.sim.samples.motion import WHOLE_TURN
from servoid.sim.samples.moving import write_moving_sample
from servoid.sim.samples.sample import write_sample
from servoid.sim.samples.scene import Look, MovingScene, Scenario
from servoid.sim.samples.surface import outer_mesh
from servoid.sim.self_test import SelfTest, run_self_test
from servoid.sim.serial_arm import SerialArm

__all__ = [
    "WHOLE_TURN",
    "Look",
    "MovingScene",
    "Scenario",
    "SerialArm",
    "read_arm",
    "write_moving_sample",
    "write_sample",
]

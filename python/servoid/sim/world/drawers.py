"""Which names stand for what draws a world."""

from collections.abc import Callable, Sequence

from servoid.sim.world.gl_stage import OpenGl
from servoid.sim.world.stages import Drawer, Raycaster
from servoid.sim.world.things import Thing

DRAWERS: dict[str, Callable[[Sequence[Thing]], Drawer]] = {
    "raycast": Raycaster,
    "mujoco": OpenGl,
}

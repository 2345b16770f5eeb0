"""Which names stand for what draws a world."""

from collections.abc import Callable, Sequence

from servoid.sim.world.cameras.gl_stage import OpenGl
from servoid.sim.world.cameras.stages import Drawer, Raycaster
from servoid.sim.world.scene.things import Thing

DRAWERS: dict[str, Callable[[Sequence[Thing]], Drawer]] = {
    "raycast": Raycaster,
    "mujoco": OpenGl,
}

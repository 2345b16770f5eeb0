"""The renderers of a world by their names."""

from collections.abc import Callable, Sequence

from servoid.sim.world.cameras.gl_renderer import OpenGl
from servoid.sim.world.cameras.renderer import Raycaster, Renderer
from servoid.sim.world.scene.visuals import Visual

RENDERERS: dict[str, Callable[[Sequence[Visual]], Renderer]] = {
    "raycast": Raycaster,
    "mujoco": OpenGl,
}

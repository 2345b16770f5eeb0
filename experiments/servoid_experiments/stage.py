"""What two eyes see of objects in the simulated world, without an arm."""

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Camera, Lens
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.world.cameras.renderer import Depth, Image, Raycaster, Shot
from servoid.sim.world.events.motions import STILL, compose, row_of, unit_row
from servoid.sim.world.scene.visuals import OBJECT, Visual


class EyeMode(Enum):
    """Where two eyes look: both at the object, or both straight ahead."""

    VERGED = "verged"
    PARALLEL = "parallel"


class Stage:
    """Visuals, which are carried by an object or by the room, and a renderer of one thread."""

    def __init__(self, visuals: Sequence[Visual]) -> None:
        self.visuals = tuple(visuals)
        self.carried = np.array([unit_row(one.carrier_from_visual) for one in visuals])
        self._raycaster = Raycaster(self.visuals)
        self._own = [place for place, one in enumerate(visuals) if one.carrier == OBJECT]

    def places(self, carriers: Mapping[str, Floats]) -> Floats:
        """Return the poses (T, 7) of all visuals in the world, by those (7,) of their carriers.

        A carrier without a pose is at the world's origin.
        """
        rows = [carriers.get(one.carrier, np.array(STILL)) for one in self.visuals]
        return compose(np.array(rows), self.carried)

    def image(self, lens: Lens, eye: Pose, places: Floats, **look: Any) -> Image:
        """Return the image of a lens; `look` are the other fields of a `Shot`."""
        shot = Shot(
            lens=lens,
            world_from_lens=row_of(eye)[None],
            world_from_visuals=places[None],
            threads=1,
            **look,
        )
        return self._raycaster.image(shot)

    def depth(self, lens: Lens, eye: Pose, places: Floats) -> Depth:
        """Return depths along z (H, W) in metres, NaN without, and visuals' numbers, -1 without."""
        return self._raycaster.depth(lens, row_of(eye), places)

    def mask(self, numbers: NDArray[np.int32]) -> Image:
        """Return the object's mask (H, W) uint8, 255 inside, from the visuals' numbers."""
        return np.where(np.isin(numbers, self._own), np.uint8(255), np.uint8(0))


def pinhole(lens: Lens) -> Camera:
    """Return the camera of a lens without distortion."""
    return Camera(size_px=lens.size_px, focal_px=lens.focal_px, center_px=lens.center_px)

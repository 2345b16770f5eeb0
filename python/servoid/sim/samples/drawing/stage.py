"""Renders the scene of a sample with the ray-caster."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens
from servoid.pose import Floats, Pose
from servoid.sim.world.cameras.renderer import Raycaster, Shot
from servoid.sim.world.events.motions import STILL, compose, row_of, unit_row
from servoid.sim.world.scene.visuals import Visual


class Stage:
    """Visuals under a lamp; those whose carrier has no pose are static."""

    def __init__(
        self, visuals: Sequence[Visual], toward: tuple[float, float, float], level: float
    ) -> None:
        self._raycaster = Raycaster(visuals)
        self._carriers = [visual.carrier for visual in visuals]
        self._carried = np.array([unit_row(visual.carrier_from_visual) for visual in visuals])
        self._toward, self._level = toward, level

    def image(
        self,
        lens: Lens,
        world_from_lens: Floats,
        poses: Mapping[str, Floats],
        *,
        samples: int,
        noise: float,
        seed: int,
    ) -> NDArray[np.uint8]:
        """Return an image (H, W, 3) uint8 RGB; poses are (4, 4), those of carriers by name."""
        return self._raycaster.image(
            Shot(
                lens=lens,
                world_from_lens=_row(world_from_lens)[None],
                world_from_visuals=self._placed(poses)[None],
                toward=self._toward,
                level=self._level,
                samples=samples,
                noise=noise,
                seed=seed,
            )
        )

    def shows(
        self, carrier: str, lens: Lens, world_from_lens: Floats, poses: Mapping[str, Floats]
    ) -> NDArray[np.bool_]:
        """Return the mask (H, W) of the visuals of a carrier."""
        _, numbers = self._raycaster.depth(lens, _row(world_from_lens), self._placed(poses))
        carried = np.array([name == carrier for name in self._carriers])
        return np.asarray((numbers >= 0) & carried[np.maximum(numbers, 0)])

    def _placed(self, poses: Mapping[str, Floats]) -> Floats:
        rows = {carrier: _row(pose) for carrier, pose in poses.items()}
        still = np.array(STILL)
        return compose(
            np.array([rows.get(carrier, still) for carrier in self._carriers]), self._carried
        )


def _row(pose: Floats) -> Floats:
    return row_of(Pose(pose))

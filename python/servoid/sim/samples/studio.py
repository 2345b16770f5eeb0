"""The sample's photographs: cameras around a table with a bird under a lamp."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens
from servoid.pose import looking
from servoid.sim.samples import bird
from servoid.sim.samples.drawing.stage import Stage
from servoid.sim.world.objects.prints import grain
from servoid.sim.world.scene.visuals import OBJECT, Finish, Plane, Texture, Visual

_TOWARD_LAMP = (0.42078, -0.46085, 0.78141)
_LEVEL = 1.0
_CLOTH = (0.46, 0.48, 0.50)
_CLOTH_PX, _CLOTH_STRENGTH, _THREAD = 512, 0.16, 6.0
_CLOTH_REPEAT = 6.0
_TABLE_HALF = 1.2  # metres
_SAMPLES = 3  # rays along a pixel's side
_SENSOR_NOISE = 1.6  # standard deviation in grey levels
_ELEVATIONS_DEG = (17.0, 38.0, 60.0)


@dataclass(frozen=True)
class Shot:
    """One photograph to take: a pinhole camera and its pose `world_from_camera` (4, 4)."""

    size_px: tuple[int, int]
    focal_px: float
    center_px: tuple[float, float]
    world_from_camera: NDArray[np.float64]


def plan_shots(count: int, size_px: tuple[int, int]) -> list[Shot]:
    """Return `count` shots once around the table, from three heights in turn."""
    width, height = size_px
    shots = []
    for index in range(count):
        azimuth = 2.0 * np.pi * (index + 0.35) / count
        elevation = np.radians(_ELEVATIONS_DEG[index % len(_ELEVATIONS_DEG)])
        # The distances vary, as by hand.
        away = 0.53 + 0.02 * np.sin(2.4 * index)
        aim = np.array([-0.008, 0.010, 0.092]) + 0.006 * np.sin([1.7 * index, 2.9 * index, index])
        toward = np.array(
            [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
        )
        pose = looking(aim + away * toward, aim).matrix()
        center_px = ((width - 1) / 2.0, (height - 1) / 2.0)
        shots.append(Shot(size_px, 1.35 * width, center_px, pose))
    return shots


def photograph(shot: Shot, seed: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Render one photograph: the image (H, W, 3) RGB and the bird's mask (H, W), 255 inside."""
    lens = Lens(
        model="pinhole",
        size_px=shot.size_px,
        focal_px=(shot.focal_px, shot.focal_px),
        center_px=shot.center_px,
    )
    pose = shot.world_from_camera
    image = _stage().image(lens, pose, {}, samples=_SAMPLES, noise=_SENSOR_NOISE, seed=seed)
    seen = _stage().shows(OBJECT, lens, pose, {})
    return image, np.where(seen, np.uint8(255), np.uint8(0))


@cache
def _stage() -> Stage:
    table = Visual(
        Plane((_TABLE_HALF, _TABLE_HALF)),
        Finish(texture=_cloth(), repeat=(_CLOTH_REPEAT, _CLOTH_REPEAT)),
    )
    return Stage([bird.visual(), table], _TOWARD_LAMP, _LEVEL)


def _cloth() -> Texture:
    """Return threads along and across."""
    size = (_CLOTH_PX, _CLOTH_PX)
    along, across = (
        grain(size, _CLOTH, _CLOTH_STRENGTH, _THREAD, seed=seed).astype(np.uint16)
        for seed in (7, 8)
    )
    return ((along + across.transpose(1, 0, 2)) // 2).astype(np.uint8)

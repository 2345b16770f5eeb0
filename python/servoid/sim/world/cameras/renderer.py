"""The interface of renderers, and servoid's ray-caster as one of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Lighting, Paint, Scene
from servoid.pose import Floats
from servoid.sim.world.scene.visuals import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Finish,
    MeshShape,
    Plane,
    Visual,
)

_WELL_EXPOSED = 1.3  # of the ray-caster's light, at level 1

Image = NDArray[np.uint8]
Depth = tuple[NDArray[np.float32], NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class Shot:
    """The parameters of an image, at M moments of one exposure.

    `world_from_lens` is (M, 7) and `world_from_visuals` (M, T, 7); `toward` points at the lamp and
    `level` is its brightness; `noise` is in grey levels.
    """

    lens: Lens
    world_from_lens: Floats
    world_from_visuals: Floats
    toward: tuple[float, float, float]
    level: float
    samples: int
    noise: float = 0.0
    seed: int = 0
    threads: int = 0


class Renderer(Protocol):
    """Renders the visuals with which it was created."""

    def image(self, shot: Shot) -> Image:
        """Return an image (H, W, 3) uint8 RGB."""
        ...

    def depth(self, lens: Lens, world_from_lens: Floats, world_from_visuals: Floats) -> Depth:
        """Return depths along z (H, W) in metres, NaN without, and visuals' numbers, -1 without.

        `world_from_lens` is (7,), `world_from_visuals` (T, 7).
        """
        ...


class Raycaster:
    """Renders with servoid's ray-caster: the same bits on every machine and number of threads."""

    def __init__(self, visuals: Sequence[Visual]) -> None:
        self._scene = Scene()
        for visual in visuals:
            _add(self._scene, visual)

    def image(self, shot: Shot) -> Image:
        """Return an image (H, W, 3) uint8 RGB."""
        return self._scene.render(
            lens=shot.lens,
            world_from_lens=shot.world_from_lens,
            world_from_visual=shot.world_from_visuals,
            lighting=Lighting(toward=shot.toward, exposure=_WELL_EXPOSED * shot.level),
            samples=shot.samples,
            noise=shot.noise,
            seed=shot.seed,
            threads=shot.threads,
        )

    def depth(self, lens: Lens, world_from_lens: Floats, world_from_visuals: Floats) -> Depth:
        """Return depths (H, W) in metres, NaN without, and visuals' numbers, -1 without."""
        return self._scene.depth(
            lens=lens, world_from_lens=world_from_lens, world_from_visual=world_from_visuals
        )


def _add(scene: Scene, visual: Visual) -> int:
    paint = _paint(visual.finish)
    match visual.shape:
        case Ellipsoid(radii):
            return scene.add_ellipsoid(radii, paint)
        case Capsule(radius, half_length):
            return scene.add_capsule(radius, half_length, paint)
        case Cylinder(radius, half_length):
            return scene.add_cylinder(radius, half_length, paint)
        case Box(half_size):
            return scene.add_box(half_size, paint)
        case Plane(half_size):
            return scene.add_plane(half_size, paint)
        case MeshShape(vertices, faces, coordinates, colors):
            return scene.add_mesh(
                np.ascontiguousarray(vertices),
                np.ascontiguousarray(faces),
                paint,
                texture_coordinates=coordinates,
                colors=colors,
            )


def _paint(finish: Finish) -> Paint:
    return Paint(
        color=finish.linear, texture=finish.texture, repeat=finish.repeat, gloss=finish.gloss
    )

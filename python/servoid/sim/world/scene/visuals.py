"""The visible shapes of a world, each with a finish, on bodies that may move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.camera import linear_light
from servoid.pose import Floats
from servoid.sim.world.events.motions import STILL

ROOM, OBJECT, BOARD = "room", "object", "board"  # carriers that are not part of an arm

Color = tuple[float, float, float]
Texture = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Finish:
    """How a surface looks: one colour (sRGB, 0 to 1) times a texture (H, W, 3) sRGB, if any.

    `repeat` is how often the texture repeats along u and v; `gloss` is from 0, matt, to 1.
    """

    color: Color = (1.0, 1.0, 1.0)
    texture: Texture | None = None
    repeat: tuple[float, float] = (1.0, 1.0)
    gloss: float = 0.0

    @property
    def linear(self) -> Color:
        """Return the colour in linear light."""
        red, green, blue = linear_light(self.color).tolist()
        return red, green, blue


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid with radii along its axes."""

    radii: tuple[float, float, float]


@dataclass(frozen=True)
class Capsule:
    """A cylinder along z with hemispherical ends."""

    radius: float
    half_length: float


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z with flat ends."""

    radius: float
    half_length: float


@dataclass(frozen=True)
class Box:
    """A box."""

    half_size: tuple[float, float, float]


@dataclass(frozen=True)
class Plane:
    """A rectangle perpendicular to z, visible from above."""

    half_size: tuple[float, float]


@dataclass(frozen=True, eq=False)
class MeshShape:
    """Triangles: vertices (N, 3), faces (M, 3) int64 and, for a texture, coordinates (N, 2).

    `colors` (N, 3) uint8 sRGB are those of the vertices; only the ray-caster draws them.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    texture_coordinates: Floats | None = None
    colors: NDArray[np.uint8] | None = None


Shape = Ellipsoid | Capsule | Cylinder | Box | Plane | MeshShape


@dataclass(frozen=True, eq=False)
class Visual:
    """A shape with a finish; `carrier_from_visual` is (w, x, y, z, tx, ty, tz)."""

    shape: Shape
    finish: Finish
    carrier: str = ROOM
    carrier_from_visual: Sequence[float] | Floats = STILL

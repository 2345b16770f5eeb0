"""A body ready for export: its ellipsoids, its colours and its mass."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.errors import ExportError
from servoid.shape import BodyFile

GREY = (180, 180, 180)  # for bodies without colours
_LEAST_NORMAL = 1e-300

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Piece:
    """An ellipsoid: `link_from_ellipsoid`, radii (3,) float64 in metres, and an RGB colour."""

    pose: Pose
    radii: Vector
    color: tuple[int, int, int]

    @property
    def factor(self) -> NDArray[np.float64]:
        """Return R diag(radii), (3, 3): it maps the unit ball to the ellipsoid about its centre."""
        return self.pose.matrix()[:3, :3] * self.radii

    @property
    def center(self) -> Vector:
        """Return the centre, (3,)."""
        return self.pose.matrix()[:3, 3]

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Return the colour with channels from 0 to 1."""
        red, green, blue = self.color
        return red / 255.0, green / 255.0, blue / 255.0


@dataclass(frozen=True, eq=False)
class Solid:
    """A rigid link: pieces and mass properties in its own frame, and the pose of that frame.

    `frame_from_link` maps the link's frame to the requested frame. `centroid` (3,) is in metres,
    `inertia` (3, 3) about it in kg m², both in the link's axes.
    """

    name: str
    frame_from_link: Pose
    pieces: tuple[Piece, ...]
    volume_m3: float
    mass_kg: float
    centroid: Vector
    inertia: NDArray[np.float64]

    def moved(self) -> "Solid":
        """Return the same solid with all numbers in the requested frame."""
        pose = self.frame_from_link
        turn = pose.matrix()[:3, :3]
        return replace(
            self,
            frame_from_link=Pose.identity(),
            pieces=tuple(replace(piece, pose=pose @ piece.pose) for piece in self.pieces),
            centroid=turn @ self.centroid + pose.matrix()[:3, 3],
            inertia=turn @ self.inertia @ turn.T,
        )


def solid_of(file: BodyFile, name: str, density_kg_m3: float, frame_from_object: Pose) -> Solid:
    """Compute the mass of a body and give its link the object's frame.

    Raises:
        ExportError: the body is so small or large that its mass overflows or underflows.

    """
    body = file.body()
    volume, centroid, inertia = body.mass_properties()
    mass = density_kg_m3 * volume
    inertia = 0.5 * density_kg_m3 * (inertia + inertia.T)
    numbers = [mass, *centroid, *inertia.ravel()]
    least = float(np.linalg.eigvalsh(inertia).min()) if np.isfinite(numbers).all() else 0.0
    if not (math.isfinite(mass) and mass > _LEAST_NORMAL and least > _LEAST_NORMAL):
        raise ExportError(
            f"a body of {volume:.3g} m³ at {density_kg_m3:g} kg/m³ has a mass and inertia that "
            "floating-point numbers cannot represent; are its lengths in metres?"
        )
    pieces = tuple(
        Piece(Pose.from_parts(center, rotation), radii, entry.color or GREY)
        for entry, center, rotation, radii in zip(
            file.ellipsoids,
            body.centers.tolist(),
            body.rotations.tolist(),
            body.radii,
            strict=True,
        )
    )
    return Solid(name, frame_from_object, pieces, volume, mass, centroid, inertia)

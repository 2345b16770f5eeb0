"""Bodies to export, and what is true of them, computed without the exporters."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.shape import BodyFile, EllipsoidEntry

Array = NDArray[np.float64]
HALF = float(np.sqrt(0.5))
# Turned by 90 degrees about y, where roll and yaw cannot be told apart.
UPRIGHT = (HALF, 0.0, HALF, 0.0)


def rotation_of(wxyz: object) -> Rotation:
    return Rotation.from_quat(np.asarray(wxyz), scalar_first=True)


def random_body(seed: int, count: int) -> BodyFile:
    """Make ellipsoids that overlap more often than not, and a pose of the object."""
    random = np.random.default_rng(seed)
    rotations = Rotation.random(count + 1, random_state=seed).as_quat(scalar_first=True)
    entries = tuple(
        EllipsoidEntry(
            center=tuple(random.normal(0.0, 0.03, 3).tolist()),
            radii=tuple(random.uniform(0.01, 0.05, 3).tolist()),
            rotation=tuple(rotation.tolist()) if index else UPRIGHT,
            color=tuple(random.integers(0, 256, 3).tolist()),
        )
        for index, rotation in enumerate(rotations[:count])
    )
    translation = random.normal(0.0, 2.0, 3).tolist()
    pose = (*translation, *rotations[-1].tolist())
    return BodyFile(version=1, units="m", world_from_object=pose, ellipsoids=entries)


bodies = st.builds(random_body, st.integers(0, 10**6), st.integers(1, 5))


@dataclass(frozen=True, eq=False)
class Truth:
    """A body's ellipsoids, and its union's volume, centroid and inertia, in the frame asked for."""

    centers: Array
    rotations: Array
    radii: Array
    volume: float
    centroid: Array
    inertia: Array

    @property
    def shapes(self) -> Array:
        """Return R diag(r²) Rᵀ, (K, 3, 3)."""
        return (self.rotations * self.radii[:, None, :] ** 2) @ self.rotations.transpose(0, 2, 1)

    def levels(self, points: Array) -> Array:
        """Return how far out points (N, 3) are in each ellipsoid, (K, N): 1 on its surface."""
        away = points[None] - self.centers[:, None]
        return np.linalg.norm(away @ self.rotations / self.radii[:, None], axis=2)


def truth(file: BodyFile, frame: str = "object") -> Truth:
    """Return what a body is; the mass alone is the core's, which has tests of its own."""
    turn, shift = np.eye(3), np.zeros(3)
    if frame == "world":
        shift = np.array(file.world_from_object[:3])
        turn = rotation_of(file.world_from_object[3:]).as_matrix()
    volume, centroid, inertia = file.body().mass_properties()
    return Truth(
        np.array([entry.center for entry in file.ellipsoids]) @ turn.T + shift,
        turn @ rotation_of([entry.rotation for entry in file.ellipsoids]).as_matrix(),
        np.array([entry.radii for entry in file.ellipsoids]),
        volume,
        turn @ centroid + shift,
        turn @ inertia @ turn.T,
    )

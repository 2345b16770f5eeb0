"""What is true of a body in the world, computed without servoid's core."""

from dataclasses import dataclass

import numpy as np
from conftest import Drawing, hit_depths
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from servoid.shape import Body, BodyFile

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WorldBody:
    """A body's ellipsoids in the world: (K, 3), (K, 3, 3) and (K, 3)."""

    centers: Array
    rotations: Array
    radii: Array
    world_from_object: Array

    @classmethod
    def of(cls, file: BodyFile) -> "WorldBody":
        turn = Rotation.from_quat(file.world_from_object[3:], scalar_first=True).as_matrix()
        place = np.array(file.world_from_object[:3])
        parts = np.array([one.rotation for one in file.ellipsoids])
        return cls(
            centers=np.array([one.center for one in file.ellipsoids]) @ turn.T + place,
            rotations=turn @ Rotation.from_quat(parts, scalar_first=True).as_matrix(),
            radii=np.array([one.radii for one in file.ellipsoids]),
            world_from_object=turn,
        )

    @classmethod
    def stood(cls, body: Body) -> "WorldBody":
        """Return a body where it stands."""
        pose = body.world_from_object.matrix()
        parts = Rotation.from_quat(body.rotations, scalar_first=True).as_matrix()
        return cls(
            centers=body.centers @ pose[:3, :3].T + pose[:3, 3],
            rotations=pose[:3, :3] @ parts,
            radii=np.asarray(body.radii),
            world_from_object=pose[:3, :3],
        )

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Say which of the points (N, 3) are inside."""
        return np.any([self._levels(index, points) < 1.0 for index in range(len(self.radii))], 0)

    def distances(self, points: Array) -> Array:
        """Measure how far points (N, 3) are from the surface of the union, to half a millimetre."""
        random = np.random.default_rng(0)
        ways = random.normal(size=(20_000, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        parts = []
        for index, (center, turn, radii) in enumerate(
            zip(self.centers, self.rotations, self.radii, strict=True)
        ):
            skin = center + (ways * radii) @ turn.T
            others = [other for other in range(len(self.radii)) if other != index]
            hidden = np.zeros(len(skin), bool)
            for other in others:
                hidden |= self._levels(other, skin) < 1.0
            parts.append(skin[~hidden])
        return KDTree(np.concatenate(parts)).query(points)[0]

    def silhouette(self, world_from_camera: Array) -> NDArray[np.bool_]:
        """Say which pixels of a drawing's camera see the body."""
        seen = [
            np.isfinite(hit_depths(world_from_camera, (turn / radii**2) @ turn.T, center))
            for center, turn, radii in zip(self.centers, self.rotations, self.radii, strict=True)
        ]
        return np.any(seen, axis=0)

    def ious(self, drawing: Drawing) -> Array:
        """Compare the silhouettes with the true masks of all views of a drawing."""
        return np.array(
            [
                overlap(self.silhouette(pose), drawing.mask(pose) != 0)
                for pose in drawing.world_from_cameras()
            ]
        )

    def _levels(self, index: int, points: Array) -> Array:
        local = (points - self.centers[index]) @ self.rotations[index] / self.radii[index]
        return (local * local).sum(axis=1)


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Measure the intersection over union."""
    return float((one & other).sum() / (one | other).sum())

"""The voxels inside a closed mesh."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose.exact import Floats

_OFF = np.array([0.3819, 0.4142, 0.5])  # of a voxel: offset so that lines meet no vertex of a mesh


@dataclass(frozen=True, eq=False)
class Voxels:
    """The centres (N, 3) of the voxels inside a solid, and the volume of each."""

    middles: Floats
    volume: float

    @property
    def total(self) -> float:
        """Return their total volume."""
        return self.volume * len(self.middles)


def voxels_of(vertices: Floats, faces: NDArray[np.int64], count: int) -> Voxels:
    """Return the voxels inside a mesh, with `count` voxels along its longest side.

    Parts may overlap. Hollows that are enclosed on all sides but above and below, y, count as
    inside: no outline from the side distinguishes them from a solid.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = float((high - low).max()) / count
    counts = np.ceil((high - low) / size).astype(int)
    held = _filled(_winding(vertices, faces, (low, size, counts)) > 0)
    middles = low + size * (np.argwhere(held) + _OFF)
    return Voxels(middles, size**3)


def _winding(
    vertices: Floats, faces: NDArray[np.int64], grid: tuple[Floats, float, NDArray[np.int_]]
) -> NDArray[np.int_]:
    """Return the winding number of each voxel, from the crossings of lines along z."""
    low, size, counts = grid
    passed = np.zeros((*counts[:2], counts[2] + 1), int)
    places = (vertices - low) / size - _OFF
    for corners in places[faces]:
        first, second = corners[1, :2] - corners[0, :2], corners[2, :2] - corners[0, :2]
        area = first[0] * second[1] - first[1] * second[0]
        if area == 0.0:
            continue
        start = np.maximum(np.ceil(corners[:, :2].min(axis=0)), 0).astype(int)
        end = np.minimum(np.floor(corners[:, :2].max(axis=0)) + 1, counts[:2]).astype(int)
        i, j = (part.ravel() for part in np.mgrid[start[0] : end[0], start[1] : end[1]])
        x, y = i - corners[0, 0], j - corners[0, 1]
        along = (x * second[1] - y * second[0]) / area
        aside = (first[0] * y - first[1] * x) / area
        meets = (along >= 0.0) & (aside >= 0.0) & (along + aside <= 1.0)
        rise = corners[1:, 2] - corners[0, 2]
        depth = corners[0, 2] + along[meets] * rise[0] + aside[meets] * rise[1]
        k = np.clip(np.ceil(depth), 0, counts[2]).astype(int)
        np.add.at(passed, (i[meets], j[meets], k), -1 if area > 0.0 else 1)
    return np.cumsum(passed, axis=2)[..., :-1]


def _filled(held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the voxels inside, including those enclosed along both x and z."""
    walled = [
        np.logical_or.accumulate(held, axis=axis)
        & np.flip(np.logical_or.accumulate(np.flip(held, axis), axis=axis), axis)
        for axis in (0, 2)
    ]
    return held | (walled[0] & walled[1])

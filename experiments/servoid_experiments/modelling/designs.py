"""Objects whose exact shape is known: what cameras around them see, and their volume.

An object is at the origin of its own frame: x right, y down, z away.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Lens, Paint, Scene, View
from servoid.errors import SimError
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.samples import bird
from servoid.sim.world.events.motions import STILL, pose_of, row_of, unit_row
from servoid.sim.world.objects import OBJECTS, make_object
from servoid.sim.world.scene.meshes import as_mesh
from servoid.words import alternatives
from servoid_experiments.metrics import held_by

_BIRD = "bird"
_BIRD_SPACING = 0.003
VOXELS = 80  # along the longest side
DESIGNS = (_BIRD, *OBJECTS)
_UP = np.array([0.0, -1.0, 0.0])
GOLDEN = float(np.pi * (3.0 - np.sqrt(5.0)))  # spreads any number of views evenly
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


@dataclass(frozen=True, eq=False)
class Design:
    """An object's surface in its own frame, x right, y down, z away, and its volume.

    `vertices` is (N, 3) and `faces` (M, 3); parts may overlap.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    voxels: Voxels
    stage: Scene

    def mask(self, camera: Camera, object_from_camera: Pose) -> NDArray[np.uint8]:
        """Return the object's silhouette in a camera: (H, W) uint8, 255 inside."""
        lens = Lens(
            model="pinhole",
            size_px=camera.size_px,
            focal_px=camera.focal_px,
            center_px=camera.center_px,
        )
        _, numbers = self.stage.depth(
            lens=lens,
            world_from_lens=row_of(object_from_camera),
            world_from_visual=np.array([STILL]),
        )
        return np.where(numbers >= 0, np.uint8(255), np.uint8(0))

    def views(self, camera: Camera, poses: Sequence[Pose]) -> list[View]:
        """Return exact views of the object from poses of a camera in its frame."""
        return [
            View(camera=camera, world_from_camera=pose, mask=self.mask(camera, pose))
            for pose in poses
        ]

    def volume_iou(self, body: Body) -> float:
        """Return the intersection over union of the volumes of object and body."""
        shared = self.voxels.volume * np.count_nonzero(held_by(body, self.voxels.middles))
        return float(shared / (self.voxels.total + body.mass_properties()[0] - shared))


@lru_cache(maxsize=len(DESIGNS))
def design_of(name: str) -> Design:
    """Return the design of an object, always the same instance.

    Raises:
        SimError: there is no such object.

    """
    if name not in DESIGNS:
        raise SimError(f"unknown object '{name}'{alternatives(name, DESIGNS)}")
    vertices, faces = _bird() if name == _BIRD else _shipped(name)
    stage = Scene()
    stage.add_mesh(vertices, faces, Paint())
    return Design(vertices, faces, voxels_of(vertices, faces, VOXELS), stage)


def _shipped(name: str) -> tuple[Floats, NDArray[np.int64]]:
    vertices: list[Floats] = []
    faces: list[NDArray[np.int64]] = []
    for thing in make_object(name):
        mesh = as_mesh(thing.shape)
        object_from_thing = pose_of(unit_row(thing.carrier_from_visual))
        faces.append(mesh.faces + sum(map(len, vertices)))
        vertices.append(object_from_thing.transform(np.ascontiguousarray(mesh.vertices)))
    return np.concatenate(vertices), np.concatenate(faces)


def _bird() -> tuple[Floats, NDArray[np.int64]]:
    """Return the sample's bird, which is on the ground with z up, about its middle."""
    center = np.array(bird.BOUND_CENTER)
    vertices, faces = bird.mesh(_BIRD_SPACING)
    x, y, z = (vertices - center).T
    return np.ascontiguousarray(np.stack([x, -z, y], axis=1)), faces


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


def around(
    count: int,
    begin: float,
    elevations_deg: Sequence[float],
    away: float,
    *,
    step: float = GOLDEN,
) -> list[Pose]:
    """Return `object_from_camera` of cameras on all sides of the object, at alternating heights.

    `begin` in radians is the angle of the first one. Each next one is `step` radians further: by
    default 137.5 degrees, so that even two see different outlines. All look at the origin from
    `away` metres.
    """
    poses = []
    for index in range(count):
        azimuth = begin + step * index
        rise = np.radians(elevations_deg[index % len(elevations_deg)])
        level = np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
        poses.append(watching(away * (np.cos(rise) * level + np.sin(rise) * _UP)))
    return poses


def watching(place: NDArray[np.float64]) -> Pose:
    """Return `object_from_camera` of a level camera at a position (3,) that looks at the origin."""
    forward: Floats = -place / np.linalg.norm(place)
    right = np.cross(forward, _UP)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(forward, right), forward
    matrix[:3, 3] = place
    return Pose(matrix)

"""Objects whose exact shape is known: their volume, and what cameras see of them."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Lens, Paint, Scene
from servoid.errors import SimError
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.samples import bird
from servoid.sim.world.events.motions import STILL, pose_of, row_of, unit_row
from servoid.sim.world.objects import OBJECTS, make_object
from servoid.sim.world.scene.meshes import as_mesh
from servoid_experiments.metrics import held_by
from servoid_experiments.modelling.voxels import Voxels, voxels_of

_BIRD = "bird"
_BIRD_SPACING = 0.003
VOXELS = 80  # along the longest side
DESIGNS = (_BIRD, *OBJECTS)


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
        raise SimError(f"unknown object '{name}'; choose one of {', '.join(DESIGNS)}")
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

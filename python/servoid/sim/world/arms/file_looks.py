"""The visuals of an arm from a file."""

from typing import Any

import numpy as np

from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.visuals import (
    ROOM,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Finish,
    MeshShape,
    Shape,
    Visual,
)

_SHOWN_GROUPS = 3  # MuJoCo shows the groups 0, 1 and 2


def file_visuals(model: Any) -> tuple[Visual, ...]:
    """Return the visible geoms of a `mujoco.MjModel` as visuals, without their textures."""
    visuals = []
    for index in range(model.ngeom):
        red, green, blue, opacity = _color(model, index)
        shape = _shape(model, index)
        if shape is None or opacity == 0.0 or model.geom_group[index] >= _SHOWN_GROUPS:
            continue
        body = model.body(int(model.geom_bodyid[index]))
        visuals.append(
            Visual(
                shape,
                Finish(color=(red, green, blue), gloss=0.2),
                ROOM if body.id == 0 else body.name,
                np.concatenate([model.geom_quat[index], model.geom_pos[index]]),
            )
        )
    return tuple(visuals)


def _color(model: Any, index: int) -> tuple[float, float, float, float]:
    material = int(model.geom_matid[index])
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[index]
    red, green, blue, opacity = (float(part) for part in rgba)
    return red, green, blue, opacity


def _shape(model: Any, index: int) -> Shape | None:
    """Return the shape of a geom, None if it is not solid."""
    kinds = load_mujoco().mjtGeom
    a, b, c = (float(part) for part in model.geom_size[index])
    kind = int(model.geom_type[index])
    if kind == kinds.mjGEOM_SPHERE:
        return Ellipsoid((a, a, a))
    if kind == kinds.mjGEOM_ELLIPSOID:
        return Ellipsoid((a, b, c))
    if kind == kinds.mjGEOM_CAPSULE:
        return Capsule(a, b)
    if kind == kinds.mjGEOM_CYLINDER:
        return Cylinder(a, b)
    if kind == kinds.mjGEOM_BOX:
        return Box((a, b, c))
    if kind == kinds.mjGEOM_MESH:
        mesh = int(model.geom_dataid[index])
        corner, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
        corners = model.mesh_vert[corner : corner + int(model.mesh_vertnum[mesh])]
        faces = model.mesh_face[face : face + int(model.mesh_facenum[mesh])]
        return MeshShape(corners.astype(np.float64), faces.astype(np.int64))
    return None

"""Contacts in the physics of a world."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from servoid.pose import exact
from servoid.sim.world.events.motions import unit_row
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.meshes import as_mesh
from servoid.sim.world.scene.solids import Solids, shape_of
from servoid.sim.world.scene.visuals import MeshShape, Visual

TOUCHED = "servoid object"  # a body that follows its path, regardless of contacts
_FAR = [0.0, 0.0, -50.0]  # before its first pose


def name_geoms(spec: Any) -> None:
    """Give each geom of a `mujoco.MjSpec` a unique name."""
    for index, geom in enumerate(spec.geoms):
        geom.name = geom.name or f"servoid geom {index}"


def touching_model(spec: Any, model: Any, solids: Solids, parts: Sequence[Visual]) -> Any:
    """Return a `mujoco.MjModel` like `model`, whose geoms have names, with contacts.

    Contacts exist between parts of an arm whose distances `solids` monitors, and between the
    object's parts and the arm. An object's mesh collides as its convex hull.
    """
    mujoco = load_mujoco()
    names = _add_object(spec, parts)
    pairs = [(model.geom(one).name, model.geom(other).name) for one, other in solids.pairs]
    pairs += [(model.geom(one).name, name) for one in solids.of_arm for name in names]
    for one, other in pairs:
        spec.add_pair(geomname1=one, geomname2=other)
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    touching = spec.compile()
    touching.geom_contype[:] = touching.geom_conaffinity[:] = 0  # no other contacts
    for values in ("dof_damping", "dof_frictionloss", "jnt_stiffness"):
        getattr(touching, values)[:] = getattr(model, values)
    return touching


def greatest_force(model: Any, data: Any) -> float:
    """Return the greatest force of all contacts (`mujoco.MjData`) in N, 0 without contact."""
    mujoco = load_mujoco()
    greatest, force = 0.0, np.zeros(6)
    for index in range(data.ncon):
        mujoco.mj_contactForce(model, data, index, force)
        greatest = max(greatest, exact.norm(force[:3]))
    return greatest


def _add_object(spec: Any, parts: Iterable[Visual]) -> list[str]:
    """Add the body of an object with prescribed motion; return the names of its geoms."""
    body = spec.worldbody.add_body(name=TOUCHED, mocap=True, pos=_FAR)
    names = []
    for index, part in enumerate(parts):
        name = f"{TOUCHED} {index}"
        row = unit_row(tuple(part.carrier_from_visual))
        place = {"pos": row[4:].tolist(), "quat": row[:4].tolist()}
        shape = shape_of(part)
        if shape is None:
            _add_mesh(spec, name, as_mesh(part.shape))
            kind = load_mujoco().mjtGeom.mjGEOM_MESH
            body.add_geom(name=name, type=kind, meshname=name, **place)
        else:
            body.add_geom(name=name, type=shape[0], size=shape[1], **place)
        names.append(name)
    return names


def _add_mesh(spec: Any, name: str, mesh: MeshShape) -> None:
    hull = load_mujoco().mjtMeshInertia.mjMESH_INERTIA_CONVEX
    spec.add_mesh(
        name=name,
        uservert=np.asarray(mesh.vertices, float).ravel().tolist(),
        userface=np.asarray(mesh.faces, int).ravel().tolist(),
        inertia=hull,
    )

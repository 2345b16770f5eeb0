"""Whether an arm is free where it starts."""

from typing import Any

from servoid.errors import SimError
from servoid.pose import Floats
from servoid.sim.world.arms.robot import TILT
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.solids import Solids
from servoid.words import measured

_TOUCHING = 0.001  # m, by which contacts are soft
_OWN = "servoid "  # begins the names of bodies that no file names
_OBJECT = "move the object by object.hand_from_object, or start elsewhere by arm.start"
_POSTURE = (
    "give another posture as arm.start or arm.world_from_hand, or correct the shapes in the arm's "
    "file"
)


def check_free(plant: Any, data: Any, solids: Solids, world_from_object: Floats, name: str) -> None:
    """Check that an arm at rest touches neither the object, nor the room, nor itself.

    `plant` and `data` are the `mujoco.MjModel` with contacts and its `mujoco.MjData` at the start;
    the object is placed at a pose (7,). Parts that intersect in every posture are joined so.

    Raises:
        SimError: two bodies intersect.

    """
    data.mocap_quat[0], data.mocap_pos[0] = world_from_object[:4], world_from_object[4:]
    load_mujoco().mj_forward(plant, data)
    found = [(-one.dist, *map(int, one.geom)) for one in data.contact if one.dist < -_TOUCHING]
    found += [(depth, one, other) for one, other, depth in solids.intersecting]
    if not found:
        return
    depth, *geoms = max(found)
    names = [_named(plant, geom) for geom in geoms]
    cure = _OBJECT if "the object" in names else _POSTURE
    raise SimError(
        f"{name}: the arm would start in contact: {names[0]} and {names[1]} intersect by "
        f"{measured(1e3 * depth)} mm; {cure}"
    )


def _named(plant: Any, geom: int) -> str:
    """Return words for the body of a geom."""
    body = plant.body(plant.geom_bodyid[geom])
    if body.id == 0:
        plane = plant.geom_type[geom] == load_mujoco().mjtGeom.mjGEOM_PLANE
        return "the floor or a wall" if plane else "what stands in the room"
    if body.name == TILT:
        return "the head"
    own = body.name.removeprefix(_OWN)
    return f"'{own}'" if own == body.name else f"the {own}"

"""An arm at rest where it starts, and whether its motors carry its own weight there."""

from typing import Any

import numpy as np

from servoid.errors import SimError
from servoid.pose import Floats
from servoid.sim.world.arms.robot import Robot
from servoid.sim.world.scene.engine import load_mujoco
from servoid.words import measured


def at_rest(robot: Robot, model: Any, start: Floats) -> Any:
    """Return the `mujoco.MjData` of an arm that rests at joint angles (N,)."""
    mujoco = load_mujoco()
    data = mujoco.MjData(model)
    data.qpos[[model.joint(servo.joint).qposadr[0] for servo in robot.servos]] = start
    mujoco.mj_forward(model, data)
    return data


def check_strength(robot: Robot, plant: Any, start: Floats, name: str) -> None:
    """Check that the motors of the true arm, the `plant`, hold it at rest at `start` (N,).

    Motors that only just hold it pass, and move it slowly.

    Raises:
        SimError: a joint needs more than its greatest torque.

    """
    data = at_rest(robot, plant, start)
    needed = np.abs(data.qfrc_bias - data.qfrc_passive)
    joints = [plant.joint(servo.joint) for servo in robot.servos]
    held = np.array([needed[joint.dofadr[0]] for joint in joints])
    over = held - np.array([servo.torque for servo in robot.servos])
    worst = int(np.argmax(over))
    if over[worst] <= 0.0:
        return
    servo = robot.servos[worst]
    carried = float(plant.body_subtreemass[plant.jnt_bodyid[joints[worst].id]])
    raise SimError(
        f"{name}: the arm cannot carry its own weight where it starts: joint '{servo.joint}' needs "
        f"{measured(held[worst])} N m to hold the {measured(carried)} kg that it carries, but has "
        f"{measured(servo.torque)} N m; masses are in kg, and efforts (actuatorfrcrange in an "
        "MJCF) in N m: correct them in the file, or leave the effort out for a motor without a "
        "limit"
    )

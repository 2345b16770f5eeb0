"""Builds the arm of a world's settings, ready to start."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from servoid.errors import SimError
from servoid.pose import Floats
from servoid.servo import fixation
from servoid.sim.arm_file import ArmFile, read_arm
from servoid.sim.world.arms.file_arm import build_file_arm, is_file_name
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.arms.robot import Robot
from servoid.sim.world.arms.shipped_arm import build_shipped_arm
from servoid.sim.world.events.motions import pose_of, unit_row
from servoid.sim.world.lab import Lab
from servoid.sim.world.scene.contacts import name_geoms, touching_model
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.solids import Solids
from servoid.sim.world.scene.visuals import OBJECT, Visual
from servoid.sim.world.settings import ArmSettings, WorldSettings
from servoid.words import counted


def build_robot(settings: WorldSettings) -> Robot:
    """Build the arm that the settings name.

    Raises:
        SimError: there is no such arm, or it cannot carry the cameras.

    """
    arm = settings.arm
    if is_file_name(arm.name):
        file = _changed(read_arm(), arm)
        return build_file_arm(arm, file.eyes, file.joints.lag_s)
    return build_shipped_arm(_changed(read_arm(arm.name, arm.links), arm), arm.turning_eyes)


def _changed(file: ArmFile, arm: ArmSettings) -> ArmFile:
    """Return the description in an arm's file, with the changes of the settings."""
    joints, eyes = file.joints, file.eyes
    if arm.lag_s is not None:
        joints = replace(joints, lag_s=arm.lag_s)
    if arm.half_baseline is not None:
        eyes = replace(eyes, half_baseline=arm.half_baseline)
    return replace(file, joints=joints, eyes=eyes)


def compile_robot(robot: Robot, step_s: float) -> Any:
    """Return the servos' `mujoco.MjModel` of the robot, without contacts."""
    name_geoms(robot.spec)
    robot.spec.option.timestep = step_s
    robot.spec.option.disableflags |= int(load_mujoco().mjtDisableBit.mjDSBL_CONTACT)
    model = robot.spec.compile()
    # The servos' lag already includes the damping of the joints.
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    model.jnt_stiffness[:] = 0.0
    return model


def build_plant(
    robot: Robot, model: Any, lab: Lab, solids: Solids, visuals: Sequence[Visual]
) -> tuple[Any, bool]:
    """Return the true `mujoco.MjModel` of the robot, and whether it moves as `model` does.

    It has contacts with itself, the room and the object's parts among `visuals`.
    """
    settings = lab.settings
    plant = touching_model(
        robot.spec, model, solids, [it for it in visuals if it.carrier == OBJECT]
    )
    for servo in robot.servos:  # which only an external force can move a joint against
        joint = plant.joint(servo.joint)
        plant.jnt_limited[joint.id], plant.jnt_range[joint.id] = 1, (servo.lower, servo.upper)
    if settings.masses == 0.0 and settings.friction == 0.0:
        return plant, True
    shares = lab.mass_shares(plant.nbody)
    plant.body_mass[:] *= shares
    plant.body_inertia[:] *= shares[:, None]
    for servo in robot.servos:
        place = plant.joint(servo.joint).dofadr[0]
        needed = servo.acceleration * model.dof_M0[place]
        plant.dof_frictionloss[place] = settings.friction * needed
    mujoco = load_mujoco()
    mujoco.mj_setConst(plant, mujoco.MjData(plant))
    return plant, False


def start_angles(robot: Robot, kinematics: Kinematics, settings: WorldSettings) -> Floats:
    """Return the joint angles (N,) at the start.

    Raises:
        SimError: the settings give the wrong number of angles, or one outside a joint's limits.

    """
    given = settings.arm.start or robot.angles
    world_from_hand = robot.world_from_hand
    if settings.arm.world_from_hand is not None:
        given, world_from_hand = None, pose_of(unit_row(settings.arm.world_from_hand))
    if given is not None and len(given) not in (robot.hand_count, len(robot.servos)):
        raise SimError(
            f"arm.start has {counted(len(given), 'angle')}; give {robot.hand_count} for the hand, "
            f"or {len(robot.servos)} with those of the cameras"
        )
    start = np.zeros(len(robot.servos))
    if given is not None:
        _check_limits(robot, given)
        start[: len(given)] = given
    elif world_from_hand is not None:
        start = kinematics.reach(world_from_hand)
    chosen = given is not None and len(given) == len(robot.servos)
    if robot.turns_eyes and settings.arm.eyes_on_object and not chosen:
        place = np.array(settings.object.hand_from_object[4:])
        eyes = robot.servos[robot.hand_count :]
        lower, upper = [eye.lower for eye in eyes], [eye.upper for eye in eyes]
        wanted = fixation(robot.half_baseline, place, np.zeros(3)).angles
        start[robot.hand_count :] = np.clip(wanted, lower, upper)
    return start


def _check_limits(robot: Robot, angles: tuple[float, ...]) -> None:
    for servo, angle in zip(robot.servos, angles, strict=False):
        if not servo.lower <= angle <= servo.upper:
            raise SimError(
                f"joint {servo.joint} would start at {angle:g} rad, but its range is "
                f"{servo.lower:g} to {servo.upper:g} rad; change arm.start"
            )

"""Builds a shipped arm from its file: bodies by Denavit-Hartenberg parameters, servos, visuals."""

import math
from typing import Any

import numpy as np

from servoid.pose import Floats, exact
from servoid.sim.arm_file import ArmFile
from servoid.sim.world.arms.head import add_head, head_visuals
from servoid.sim.world.arms.robot import HAND, JointServo, Robot
from servoid.sim.world.events.motions import pose_of
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.solids import add_solids
from servoid.sim.world.scene.visuals import ROOM, Capsule, Cylinder, Finish, Visual

_SHELL = Finish(color=(0.88, 0.88, 0.86), gloss=0.3)
_DRUM = Finish(color=(0.22, 0.27, 0.34), gloss=0.4)
_TRIM = Finish(color=(0.05, 0.42, 0.47), gloss=0.3)
_RADIUS = (0.085, 0.072, 0.066, 0.058, 0.051, 0.046, 0.036)  # of the links, in m
_DRUM_RADIUS = (0.092, 0.082, 0.0, 0.068, 0.0, 0.053, 0.0)  # radius of the drums at the bends


def build_shipped_arm(arm: ArmFile, turning_eyes: bool) -> Robot:
    """Build the arm of a file in `sim/arms`, with its base at the world's origin."""
    mujoco = load_mujoco()
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    offsets = _offsets(arm)
    body = spec.worldbody
    for index, name in enumerate(arm.joints.names):
        twist = math.radians(arm.chain.twists_deg[index])
        quaternion = [exact.cos(0.5 * twist), exact.sin(0.5 * twist), 0.0, 0.0]
        body = body.add_body(name=f"{name} link", pos=offsets[index].tolist(), quat=quaternion)
        body.add_joint(name=name, axis=[0.0, 0.0, 1.0])
        _weigh(body, arm, index)
    mount = arm.hand.flange_from_hand
    hand = body.add_body(name=HAND, pos=list(mount[4:]), quat=list(mount[:4]))
    hand.explicitinertial = True
    hand.mass = arm.hand.mass
    hand.inertia = [0.4 * arm.hand.mass * 0.08 * 0.08] * 3
    eyes = add_head(hand, arm.eyes, turning_eyes)
    servos = tuple(_servo(arm, index) for index in range(len(arm.joints.names)))
    visuals = (*_links(arm, offsets), *head_visuals(arm.eyes.half_baseline, float(mount[6])))
    add_solids(spec, visuals)
    return Robot(
        spec=spec,
        visuals=visuals,
        servos=servos + eyes,
        hand_count=len(servos),
        half_baseline=arm.eyes.half_baseline,
        world_from_hand=pose_of(arm.start.world_from_hand),
    )


def _offsets(arm: ArmFile) -> list[Floats]:
    """Return the position of each joint in the frame of the one before it, (3,) each."""
    offsets = []
    lengths = iter(arm.lengths)
    for index, twist_deg in enumerate(arm.chain.twists_deg):
        length = next(lengths) if index % 2 == 0 else 0.0
        twist = math.radians(twist_deg)
        offsets.append(length * np.array([0.0, -exact.sin(twist), exact.cos(twist)]))
    return offsets


def _servo(arm: ArmFile, index: int) -> JointServo:
    joints = arm.joints
    return JointServo(
        joint=joints.names[index],
        lower=math.radians(joints.lower_deg[index]),
        upper=math.radians(joints.upper_deg[index]),
        speed=math.radians(joints.speed_deg[index]),
        acceleration=math.radians(joints.acceleration_deg[index]),
        torque=joints.torque[index],
        lag_s=joints.lag_s,
    )


def _weigh(body: Any, arm: ArmFile, index: int) -> None:
    """Set a link's mass and inertia to those of a cylinder along it, or of its half at a bend."""
    mass, radius = arm.joints.mass[index], _RADIUS[index]
    start, end = _span(arm, index)
    length = max(exact.norm(end - start), 2.0 * radius)
    across = mass * (length * length / 12.0 + radius * radius / 4.0)
    along = 0.5 * mass * radius * radius
    body.explicitinertial = True
    body.mass = mass
    body.ipos = (0.5 * (start + end)).tolist()
    body.inertia = (
        [across, along, across] if abs(end - start)[1] > 1e-9 else [across, across, along]
    )


def _span(arm: ArmFile, index: int) -> tuple[Floats, Floats]:
    """Return both ends of a link in its own frame, (3,) each.

    The frame of an odd joint is at the far end of its link, and half of the link moves with the
    joint before.
    """
    offsets = _offsets(arm)
    zero = np.zeros(3)
    if index % 2 == 1:
        return zero, 0.5 * offsets[index + 1]
    share = 1.0 if index in (0, len(offsets) - 1) else 0.5
    return np.array([0.0, 0.0, -share * exact.norm(offsets[index])]), zero


def _links(arm: ArmFile, offsets: list[Floats]) -> list[Visual]:
    """Return the visuals of the arm: a foot, a capsule per link and a drum per bend."""
    height = float(offsets[0][2])
    foot = 0.5 * (height - _DRUM_RADIUS[0])
    upright = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    visuals = [
        Visual(Cylinder(0.16, 0.015), _DRUM, ROOM, (*upright, 0.015)),
        Visual(Cylinder(0.105, foot), _SHELL, ROOM, (*upright, foot)),
    ]
    for index, name in enumerate(arm.joints.names):
        carrier, radius = f"{name} link", _RADIUS[index]
        start, end = _span(arm, index)
        half = 0.5 * exact.norm(end - start)
        middle = 0.5 * (start + end)
        turn = _ALONG_Y if abs(end - start)[1] > 1e-9 else (1.0, 0.0, 0.0, 0.0)
        if index == 0:
            visuals.append(Visual(Cylinder(radius, 0.07), _TRIM, carrier, (*upright, -0.085)))
        elif index == len(arm.joints.names) - 1:
            visuals.append(Visual(Cylinder(radius, half), _TRIM, carrier, (*turn, *middle)))
        elif half > 0.0:
            visuals.append(Visual(Capsule(radius, half), _SHELL, carrier, (*turn, *middle)))
        if _DRUM_RADIUS[index] > 0.0 and index > 0:
            drum = Cylinder(_DRUM_RADIUS[index], 1.25 * _DRUM_RADIUS[index])
            visuals.append(Visual(drum, _DRUM, carrier, (*upright, 0.0)))
    return visuals


_ALONG_Y = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)

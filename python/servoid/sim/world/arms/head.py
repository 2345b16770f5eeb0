"""The head: two cameras with a common tilt and a pan each, or two fixed ones."""

import math
from typing import Any

from servoid.sim.arm_file import EyeLimits
from servoid.sim.world.arms.robot import EYES, HAND, TILT, JointServo
from servoid.sim.world.scene.visuals import Box, Capsule, Cylinder, Ellipsoid, Finish, Visual

_BALL = 0.030  # radius of a camera's housing in m, which ends just behind the camera's centre
_BEHIND = _BALL + 0.004
_ACROSS = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)  # rotates a capsule to x
_SHELL = Finish(color=(0.93, 0.93, 0.91), gloss=0.35)
_DARK = Finish(color=(0.10, 0.11, 0.13), gloss=0.5)
_TRIM = Finish(color=(0.05, 0.42, 0.47), gloss=0.3)


def add_head(hand: Any, limits: EyeLimits, turning: bool) -> tuple[JointServo, ...]:
    """Add cameras to the body of a hand (`mujoco.MjsBody`), and return their servos."""
    tilt = hand.add_body(name=TILT)
    _weigh(tilt, 0.2, 0.05)
    if turning:
        tilt.add_joint(name=limits.names[0], axis=[-1.0, 0.0, 0.0])
    for side, name, joint in zip((-1.0, 1.0), EYES, limits.names[1:], strict=True):
        eye = tilt.add_body(name=name, pos=[side * limits.half_baseline, 0.0, 0.0])
        _weigh(eye, 0.15, 0.03)
        if turning:
            eye.add_joint(name=joint, axis=[0.0, 1.0, 0.0])
    if not turning:
        return ()
    return tuple(
        JointServo(
            joint=name,
            lower=math.radians(limits.lower_deg[index]),
            upper=math.radians(limits.upper_deg[index]),
            speed=math.radians(limits.speed_deg[index]),
            acceleration=math.radians(limits.acceleration_deg[index]),
            torque=limits.torque[index],
            lag_s=limits.lag_s,
        )
        for index, name in enumerate(limits.names)
    )


def head_visuals(half_baseline: float, reach: float) -> tuple[Visual, ...]:
    """Return the visuals of a head; `reach` is the distance of its mount behind it, in m."""
    bar = half_baseline - _BALL
    post = max(0.5 * (reach - 0.06), 0.01)
    visuals = [
        Visual(Cylinder(0.030, post), _SHELL, HAND, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.06 - post)),
        Visual(Box((0.045, 0.028, 0.018)), _TRIM, HAND, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.058)),
        Visual(Capsule(0.011, bar), _DARK, TILT, (*_ACROSS, 0.0, 0.0, -_BEHIND)),
    ]
    for eye in EYES:
        along = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        visuals += [
            Visual(Ellipsoid((_BALL, _BALL, _BALL)), _SHELL, eye, (*along, -_BEHIND)),
            Visual(Cylinder(0.017, 0.004), _DARK, eye, (*along, -0.0075)),
            Visual(Cylinder(0.021, 0.003), _TRIM, eye, (*along, -0.011)),
        ]
    return tuple(visuals)


def _weigh(body: Any, mass: float, radius: float) -> None:
    """Set a body's mass and inertia to those of a ball."""
    body.explicitinertial = True
    body.mass = mass
    body.inertia = [0.4 * mass * radius * radius] * 3

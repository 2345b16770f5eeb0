"""An arm's protective stop: torques that its model does not explain brake it until a reset."""

from typing import Any

import numpy as np

from servoid.pose import exact
from servoid.sim.world.arms.robot import Robot
from servoid.sim.world.events.motions import Floats
from servoid.sim.world.scene.engine import load_mujoco

_SMOOTHED_S = 0.004  # of the torques, so that a single step's rounding stops nothing
_GRAVITY = 9.81
_TRUSTED = 0.5  # share of the torque that stops, below which servos go on to learn what they miss


class ProtectiveStop:
    """Compares torques with those that an arm's model explains, as collaborative arms do.

    What is left pushes the joints from outside. Where it exceeds what a joint withstands the arm is
    stopped, and stays so until `reset`.
    """

    def __init__(self, most: Floats, step_s: float) -> None:
        """Take the torques (N,) in N m that joints bear, and how often they are measured."""
        self._most, self._share = most, -exact.expm1(-step_s / _SMOOTHED_S)
        self._unexplained = np.zeros(len(most))
        self.stopped: bool = False

    def see(self, torques: Floats) -> None:
        """Take in the torques (N,) in N m that the model does not explain, one step later."""
        self._unexplained += self._share * (torques - self._unexplained)
        self.stopped |= bool(np.any(np.abs(self._unexplained) > self._most))

    @property
    def pushed(self) -> bool:
        """Say if something may push the arm, so that its servos must not learn from it."""
        return bool(np.any(np.abs(self._unexplained) > _TRUSTED * self._most))

    def reset(self) -> None:
        """Let the arm move again; what still pushes it stops it once more."""
        self.stopped = False
        self._unexplained[:] = 0.0


def borne_torques(robot: Robot, model: Any, start: Floats, share: float) -> Floats:
    """Return the torques from outside (N,) in N m that an arm's joints bear.

    They are a share of each joint's greatest torque. Of a joint that has none it is what it takes
    to hold still, in the worst pose, what it carries at the start, and to accelerate it.
    """
    mujoco = load_mujoco()
    data = mujoco.MjData(model)
    joints = [model.joint(servo.joint) for servo in robot.servos]
    data.qpos[[joint.qposadr[0] for joint in joints]] = start
    mujoco.mj_forward(model, data)
    found = []
    for servo, joint in zip(robot.servos, joints, strict=True):
        body = int(model.jnt_bodyid[joint.id])
        lever = exact.norm(data.subtree_com[body] - data.xanchor[joint.id])
        needed = _GRAVITY * float(model.body_subtreemass[body]) * lever
        needed += servo.acceleration * float(model.dof_M0[joint.dofadr[0]])
        found.append(servo.torque if np.isfinite(servo.torque) else needed)
    return share * np.array(found)

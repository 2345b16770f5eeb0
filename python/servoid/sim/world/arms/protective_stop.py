"""An arm's protective stop: external torques brake it until a reset."""

from typing import Any

import numpy as np

from servoid.pose import Floats, exact
from servoid.sim.world.arms.own_weight import at_rest
from servoid.sim.world.arms.robot import Robot

_SMOOTHED_S = 0.004  # time constant of the torques, so that rounding in a single step has no effect
_GRAVITY = 9.81
_TRUSTED = 0.5  # share of the stopping torque below which the servos' integral term stays active


class ProtectiveStop:
    """Compares torques with those of an arm's model, as collaborative arms do.

    The difference is the external torque. If it exceeds a joint's threshold, the arm is stopped,
    until `reset`.
    """

    def __init__(self, most: Floats, step_s: float) -> None:
        """Take the joints' thresholds (N,) in N m, and the interval of measurements."""
        self._most, self._share = most, -exact.expm1(-step_s / _SMOOTHED_S)
        self._unexplained = np.zeros(len(most))
        self.stopped: bool = False

    def see(self, torques: Floats) -> None:
        """Process the external torques (N,) in N m of one step."""
        self._unexplained += self._share * (torques - self._unexplained)
        self.stopped |= bool(np.any(np.abs(self._unexplained) > self._most))

    @property
    def pushed(self) -> bool:
        """Return whether something may push the arm, so that the integral term must not change."""
        return bool(np.any(np.abs(self._unexplained) > _TRUSTED * self._most))

    def reset(self) -> None:
        """Let the arm move again; a persisting contact stops it again."""
        self.stopped = False
        self._unexplained[:] = 0.0


def stop_torques(robot: Robot, model: Any, start: Floats, share: float) -> Floats:
    """Return the thresholds (N,) in N m of external torques on an arm's joints.

    They are a share of each joint's maximum torque. For a joint without a maximum, it is the torque
    that holds its initial load in the worst pose, plus that of its maximum acceleration.
    """
    data = at_rest(robot, model, start)
    found = []
    for servo in robot.servos:
        joint = model.joint(servo.joint)
        body = int(model.jnt_bodyid[joint.id])
        lever = exact.norm(data.subtree_com[body] - data.xanchor[joint.id])
        needed = _GRAVITY * float(model.body_subtreemass[body]) * lever
        needed += servo.acceleration * float(model.dof_M0[joint.dofadr[0]])
        found.append(servo.torque if np.isfinite(servo.torque) else needed)
    return share * np.array(found)

"""From a hand velocity to joint speeds: the interface of joint laws, and the paper's law."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid._native import hand_weights
from servoid.pose import Floats, Pose, exact
from servoid.servo.arm import Arm, JointState
from servoid.servo.law.reach import stepped
from servoid.servo.settings import JointSettings

_TINY = 1e-9


@dataclass(frozen=True, eq=False)
class HandSetpoint:
    """The desired motion of the hand: its velocity (6,) in the world, and its goal pose."""

    twist: Floats
    world_from_goal: Pose


@dataclass(frozen=True, eq=False)
class JointSetpoint:
    """The desired joint speeds (n,) in rad/s, and `weights` (n, n) of deviations from them.

    Of the admissible speeds, the best minimise x weights x of their deviation x.
    """

    velocities: Floats
    weights: Floats


class HandJoints(Protocol):
    """A law that converts the desired motion of the hand to desired joint speeds."""

    def setpoint(self, state: JointState, jacobian: Floats, hand: HandSetpoint) -> JointSetpoint:
        """Return the desired speeds of n joints, unbounded; `jacobian` (6, n) is the hand's."""
        ...


def pseudo_inverse(jacobian: Floats) -> Floats:
    """Return the pseudo-inverse (n, 6) of a Jacobian (6, n)."""
    square = exact.product(jacobian, jacobian.T)
    # Slight damping keeps exactly singular poses solvable.
    square[np.diag_indices(6)] += _TINY
    return exact.solve(square, jacobian).T  # Eq. (15)


class PaperJoints:
    """The paper's law: inverse kinematics with the first joint at 0, and the pseudo-inverse.

    For an arm without a redundant joint, no joint is fixed at 0.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        self._arm, self._settings = arm, settings
        count = arm.joints.hand_count
        self._free = slice(1 if count > 6 else 0, count)
        self._solution: Floats | None = None

    def setpoint(self, state: JointState, jacobian: Floats, hand: HandSetpoint) -> JointSetpoint:
        """Return the desired joint speeds, without bounds."""
        count = self._arm.joints.hand_count
        desired = self.joints_at(hand.world_from_goal, state.positions)  # Eq. (14)
        feedback = self._settings.feedback_gain * (desired - state.positions)[:count]
        velocities = feedback + exact.product(pseudo_inverse(jacobian), hand.twist)  # Eq. (16)
        return JointSetpoint(velocities, hand_weights(jacobian, self._settings.angular_weight))

    def joints_at(self, world_from_goal: Pose, positions: Floats) -> Floats:
        """Return joint positions (N,) of the hand at the goal, as near as the steps have come.

        Damped Newton steps start at the last solution, the first time at `positions` (N,). The
        first joint is at 0, and the cameras stay where they are.
        """
        arm, free = self._arm, self._free
        start = positions if self._solution is None else self._solution
        found = positions.copy()
        found[: arm.joints.hand_count] = start[: arm.joints.hand_count]
        found[: free.start] = 0.0
        for _ in range(self._settings.newton_steps):
            found, _ = stepped(arm, found, world_from_goal, free)
        self._solution = found
        return found

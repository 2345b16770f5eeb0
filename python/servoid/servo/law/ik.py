"""Differential inverse kinematics as a small quadratic program."""

import numpy as np

from servoid.pose import Floats, exact
from servoid.servo.arguments import check_state
from servoid.servo.arm import Arm, JointState
from servoid.servo.law.joints import IDLE_WEIGHT, HandSetpoint, JointSetpoint
from servoid.servo.settings import JointSettings

_TINY = 1e-8


class QuadraticJoints:
    """Computes the joint speeds whose hand velocity is nearest to the desired one.

    Directions in which the arm is nearly singular are damped. Motion in the null space pulls the
    joints towards the initial posture.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        """Take the arm's present posture as the preferred one.

        Raises:
            ServoError: the arm's state is none of its joints.

        """
        state = arm.state()
        check_state(state, arm.joints)
        self._settings = settings
        self._count = arm.joints.hand_count
        self._posture = np.asarray(state.positions, np.float64)[: self._count]
        self._weights = np.repeat([1.0, settings.angular_weight], 3)

    def setpoint(self, state: JointState, jacobian: Floats, hand: HandSetpoint) -> JointSetpoint:
        """Return the best joint speeds without bounds, and the weights of deviations from them."""
        settings = self._settings
        weighted = self._weights[:, None] * jacobian
        # The singular vectors of the hand's motion come last; those before span the null space.
        squares, axes = exact.eigh(exact.product(weighted.T, weighted))
        squares = np.maximum(squares, 0.0)
        free = axes[:, : max(0, self._count - len(weighted))]
        lack = np.maximum(0.0, 1.0 - np.sqrt(squares) / settings.damped_below)
        worth = squares + np.square(settings.damping * lack) + _TINY
        worth[: free.shape[1]] = IDLE_WEIGHT
        pull = settings.posture_gain * (self._posture - state.positions[: self._count])
        wanted = exact.product(weighted.T, self._weights * hand.twist)
        slope = wanted + IDLE_WEIGHT * exact.product(free, exact.product(free.T, pull))
        velocities = exact.product(axes, exact.product(axes.T, slope) / worth)
        return JointSetpoint(velocities, exact.product(axes * worth, axes.T))

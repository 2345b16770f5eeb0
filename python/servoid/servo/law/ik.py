"""Differential inverse kinematics as a small quadratic program."""

import numpy as np

from servoid._native import QuadraticLaw
from servoid.pose import Floats
from servoid.servo.arguments import check_state
from servoid.servo.arm import Arm, JointState
from servoid.servo.law.joints import HandSetpoint, JointSetpoint
from servoid.servo.settings import JointSettings


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
        self._count = arm.joints.hand_count
        self._law = QuadraticLaw(
            np.asarray(state.positions, np.float64)[: self._count],
            settings.posture_gain,
            settings.angular_weight,
            settings.damping,
            settings.damped_below,
        )

    def setpoint(self, state: JointState, jacobian: Floats, hand: HandSetpoint) -> JointSetpoint:
        """Return the best joint speeds without bounds, and the weights of deviations from them."""
        positions = state.positions[: self._count]
        return JointSetpoint(*self._law.setpoint(jacobian, positions, hand.twist))

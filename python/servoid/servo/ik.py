"""Differential inverse kinematics as a small quadratic program, within the limits of the joints."""

import numpy as np

from servoid.errors import MissingExtraError
from servoid.servo.arm import Arm, Floats, JointState
from servoid.servo.joints import HandWish
from servoid.servo.limits import Window
from servoid.servo.settings import JointSettings

_OPTIMAL = (1, 2)  # daqp's exit flags of a solution
_POSTURE_WEIGHT = 1e-3
_TINY = 1e-8


class QuadraticJoints:
    """Finds the joint speeds whose hand velocity is nearest to the wanted one inside a window.

    Directions in which the arm is nearly singular are damped. What motion is left free pulls the
    joints towards the posture that the arm had at first.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        """Take the arm's present posture as the one to keep.

        Raises:
            MissingExtraError: the solver is not installed.

        """
        try:
            import daqp
        except ImportError as error:
            raise MissingExtraError.of("joint speeds by a QP", "daqp", "servo") from error
        self._solve = daqp.solve
        self._settings = settings
        self._count = arm.joints.hand_count
        self._posture = arm.state().positions[: self._count]
        self._weights = np.repeat([1.0, settings.angular_weight], 3)
        self._no_rows = np.empty((0, self._count))

    def velocities(
        self, state: JointState, jacobian: Floats, wish: HandWish, window: Window
    ) -> Floats:
        """Return (n,) rad/s inside the window."""
        hessian, slope = self._cost(state.positions[: self._count], jacobian, wish.twist)
        answer, _, flag, _ = self._solve(hessian, slope, self._no_rows, window.upper, window.lower)
        if flag not in _OPTIMAL or not np.all(np.isfinite(answer)):
            # The box is never empty, so only numbers can have gone wrong: the free optimum, cut.
            answer = -np.linalg.solve(hessian, slope)
        return window.bounded(np.asarray(answer, dtype=np.float64))

    def _cost(self, positions: Floats, jacobian: Floats, twist: Floats) -> tuple[Floats, Floats]:
        """Return H (n, n) and f (n,) of the cost x H x / 2 + f x of joint speeds x."""
        settings = self._settings
        left, values, right = np.linalg.svd(self._weights[:, None] * jacobian)
        damping = settings.damping * np.maximum(0.0, 1.0 - values / settings.damped_below)
        worth = np.full(self._count, _POSTURE_WEIGHT)
        worth[: len(values)] = values**2 + damping**2 + _TINY
        wanted = left.T @ (self._weights * twist)
        slope = -right[: len(values)].T @ (values * wanted[: len(values)])
        free = right[len(values) :]
        pull = settings.posture_gain * (self._posture - positions)
        slope -= _POSTURE_WEIGHT * free.T @ (free @ pull)
        return (right.T * worth) @ right, slope

"""Differential inverse kinematics as a small quadratic program, within the limits of the joints."""

import numpy as np

from servoid.errors import MissingExtraError
from servoid.pose import exact
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
        self._posture = np.asarray(arm.state().positions, np.float64)[: self._count]
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
            answer = -exact.solve(hessian, slope)
        return window.bounded(np.asarray(answer, dtype=np.float64))

    def _cost(self, positions: Floats, jacobian: Floats, twist: Floats) -> tuple[Floats, Floats]:
        """Return H (n, n) and f (n,) of the cost x H x / 2 + f x of joint speeds x."""
        settings = self._settings
        weighted = self._weights[:, None] * jacobian
        # Those of the hand's motion come last; what is before them moves the hand nowhere.
        squares, axes = exact.eigh(exact.product(weighted.T, weighted))
        squares = np.maximum(squares, 0.0)
        free = axes[:, : max(0, self._count - len(weighted))]
        lack = np.maximum(0.0, 1.0 - np.sqrt(squares) / settings.damped_below)
        worth = squares + np.square(settings.damping * lack) + _TINY
        worth[: free.shape[1]] = _POSTURE_WEIGHT
        pull = settings.posture_gain * (self._posture - positions)
        free_pull = exact.product(free, exact.product(free.T, pull))
        slope = -exact.product(weighted.T, self._weights * twist) - _POSTURE_WEIGHT * free_pull
        return exact.product(axes * worth, axes.T), slope

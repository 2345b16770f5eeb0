"""Computes joint speed commands from the desired ones under all bounds, by one QP."""

from dataclasses import dataclass

import numpy as np

from servoid._native import HandLimits
from servoid.errors import MissingExtraError
from servoid.pose import Floats, exact
from servoid.servo.keeping.bounds import Bounds, Rows, Window
from servoid.servo.keeping.safety import Reason
from servoid.servo.law.joints import JointSetpoint
from servoid.servo.settings import HandSettings

_SOLVED = (1, 2)  # daqp's exit flags of a solution, 2 with a violated soft bound
_SOFT = 8  # daqp's flag of a soft bound
_CUTS = 12  # maximum number of planes that approximate a ball
_BALLS = (Reason.HAND_SPEED, Reason.HAND_ACCELERATION) * 2  # in the order of the core
_NOTED = 1e-3  # m/s and rad/s of the hand: smaller changes do not count as limiting


@dataclass(frozen=True, eq=False)
class Limited:
    """Joint speeds (n,) inside all bounds, and which bounds changed them."""

    velocities: Floats
    reasons: frozenset[Reason]


class Limiter:
    """Finds the joint speeds nearest to the desired ones inside all bounds, and the active bounds.

    The joints' window is a hard bound. Other bounds are violated only if they contradict it or each
    other.
    """

    def __init__(self, period_s: float, settings: HandSettings, fade_s: float = 0.0) -> None:
        """Take the period of the commands and the limits of the hand.

        An acceleration counts as if it continued for `fade_s` before it vanishes.

        Raises:
            MissingExtraError: the solver is not installed.

        """
        try:
            import daqp
        except ImportError as error:
            raise MissingExtraError.of("keeping joint speeds in bounds", "daqp", "servo") from error
        self._solve = daqp.solve
        speeds = np.array([settings.linear_speed, settings.angular_speed])
        accelerations = np.array([settings.linear_acceleration, settings.angular_acceleration])
        self._speeds = settings.speed_share * speeds
        steps = settings.acceleration_share * accelerations * period_s
        fading = fade_s / period_s
        self._hand = HandLimits(self._speeds.tolist(), steps.tolist(), period_s, fading)

    def bounds(
        self, jacobian: Floats, last: Floats, window: Window, walls: Rows, speed_scale: float
    ) -> Bounds:
        """Return the bounds on joint speeds (n,) after a hand velocity `last` (6,).

        `jacobian` is (6, n), and `speed_scale` the allowed share of the hand's speed.
        """
        balls = self._hand.balls(jacobian, last, speed_scale)
        return Bounds(jacobian, window, walls, balls)

    def speeds(self, speed_scale: float) -> Floats:
        """Return the hand's speed limits, (2,) in m/s and rad/s, scaled by a share."""
        return speed_scale * self._speeds

    def braking(self, jacobian: Floats) -> Floats:
        """Return the joints' decelerations (n,) in rad/s² that the hand's limit allows.

        `jacobian` is (6, n). Each joint leaves a share of the hand's limit to the other joints.
        """
        return self._hand.braking(jacobian)

    def ticks_to_rest(self, twist: Floats) -> float:
        """Return the number of periods in which the hand can come to rest from a velocity (6,)."""
        return self._hand.ticks_to_rest(twist)

    def nearest(self, setpoint: JointSetpoint, bounds: Bounds) -> Limited:
        """Return the joint speeds nearest to the desired ones, and the active bounds."""
        if bounds.hold(setpoint.velocities):
            return Limited(setpoint.velocities, frozenset())
        rows = bounds.rows
        found, pressed = self._solved(setpoint, bounds.window, rows)
        for _ in range(_CUTS):
            balls, planes, most = bounds.balls.cuts(found)
            if not balls:
                break
            reasons = tuple(_BALLS[ball] for ball in balls)
            rows = rows.and_also(Rows(planes, np.full(len(most), -np.inf), most, reasons))
            found, pressed = self._solved(setpoint, bounds.window, rows)
        off = exact.product(bounds.jacobian, found - setpoint.velocities)
        return Limited(found, pressed if np.abs(off).max() > _NOTED else frozenset())

    def _solved(
        self, setpoint: JointSetpoint, window: Window, rows: Rows
    ) -> tuple[Floats, frozenset[Reason]]:
        """Return the nearest speeds (n,) between linear bounds, and the active reasons."""
        count = len(setpoint.velocities)
        sense = np.repeat(np.array([0, _SOFT], np.int32), [count, len(rows.reasons)])
        answer, _, flag, details = self._solve(
            setpoint.weights,
            -exact.product(setpoint.weights, setpoint.velocities),
            rows.matrix,
            np.concatenate([window.upper, rows.upper]),
            np.concatenate([window.lower, rows.lower]),
            sense,
        )
        if flag not in _SOLVED or not np.all(np.isfinite(answer)):
            # The window is never empty, so this is a numerical failure: the joints brake.
            return window.bounded(np.zeros(count)), frozenset()
        pressures = np.asarray(details["lam"])
        reasons = [
            rows.reasons[place - count] if place >= count else window.causes[int(force > 0)][place]
            for place, force in enumerate(pressures)
            if force != 0.0
        ]
        return window.bounded(np.asarray(answer, np.float64)), frozenset(reasons)

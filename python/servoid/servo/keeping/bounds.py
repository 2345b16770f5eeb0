"""Bounds on the joint speeds in one control period, each with its reason."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.pose import Floats, exact
from servoid.servo.keeping.safety import Reason

INSIDE = 1e-3  # share of a ball's radius by which speeds are shortened below the bound
_EDGE = 1e-6  # share of it by which they must be shorter


@dataclass(frozen=True, eq=False)
class Window:
    """The minimum and maximum joint speeds (n,) that may be commanded, in rad/s.

    `causes` are two rows of n reasons, for the lower and the upper bounds.
    """

    lower: Floats
    upper: Floats
    causes: Sequence[Sequence[Reason]]

    def part(self, joints: slice) -> "Window":
        """Return the window of some of the joints."""
        causes = tuple(side[joints] for side in self.causes)
        return Window(self.lower[joints], self.upper[joints], causes)

    def bounded(self, velocities: Floats) -> Floats:
        """Return the nearest speeds inside."""
        return np.minimum(np.maximum(velocities, self.lower), self.upper)


@dataclass(frozen=True, eq=False)
class Rows:
    """Linear bounds: `matrix` (m, n) times joint speeds (n,) is from `lower` to `upper`, (m,)."""

    matrix: Floats
    lower: Floats
    upper: Floats
    reasons: tuple[Reason, ...]

    @classmethod
    def none(cls, count: int) -> "Rows":
        """Return no bounds on `count` joints."""
        return cls(np.empty((0, count)), np.empty(0), np.empty(0), ())

    def and_also(self, *others: "Rows") -> "Rows":
        """Concatenate bounds."""
        every = (self, *others)
        return Rows(
            np.concatenate([one.matrix for one in every]),
            np.concatenate([one.lower for one in every]),
            np.concatenate([one.upper for one in every]),
            tuple(reason for one in every for reason in one.reasons),
        )


@dataclass(frozen=True, eq=False)
class Ball:
    """Bounds a length: `matrix` (3, n) times joint speeds is within `radius` of `center` (3,)."""

    matrix: Floats
    center: Floats
    radius: float
    reason: Reason

    def exceeds(self, velocities: Floats) -> bool:
        """Return whether joint speeds (n,) are outside."""
        return exact.norm(self._off(velocities)) > self.radius * (1.0 - _EDGE)

    def cut(self, velocities: Floats) -> Rows:
        """Return the tangent plane of the ball nearest to joint speeds (n,) outside."""
        off = self._off(velocities)
        normal = off / exact.norm(off)
        most = exact.dot(normal, self.center) + self.radius * (1.0 - INSIDE)
        row = exact.product(normal, self.matrix)
        return Rows(row[None], np.full(1, -np.inf), np.array([most]), (self.reason,))

    def _off(self, velocities: Floats) -> Floats:
        return exact.product(self.matrix, velocities) - self.center


@dataclass(frozen=True, eq=False)
class Bounds:
    """All bounds on the hand's joints in one control period; `jacobian` (6, n) is the hand's.

    The window is a hard bound.
    """

    jacobian: Floats
    window: Window
    rows: Rows
    balls: tuple[Ball, ...]

    def hold(self, velocities: Floats) -> bool:
        """Return whether joint speeds (n,) are inside."""
        window, rows = self.window, self.rows
        if not np.all((velocities >= window.lower) & (velocities <= window.upper)):
            return False  # also for values that are not finite
        if rows.reasons:
            values = exact.product(rows.matrix, velocities)
            if np.any((values < rows.lower) | (values > rows.upper)):
                return False
        return not any(ball.exceeds(velocities) for ball in self.balls)

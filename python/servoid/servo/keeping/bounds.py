"""What bounds the speeds of the joints at one moment, each bound with the reason that names it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.pose import exact
from servoid.servo.arm import Floats
from servoid.servo.keeping.safety import Reason

INSIDE = 1e-3  # of a ball's radius, by which speeds are cut shorter than they may be
_EDGE = 1e-6  # of it, by which they must be shorter


@dataclass(frozen=True, eq=False)
class Window:
    """The least and the greatest speeds (n,) that joints may be told, in rad/s.

    `causes` are two rows of n reasons, which say what bounds each from below and from above.
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
        """Make what does not bound `count` joints."""
        return cls(np.empty((0, count)), np.empty(0), np.empty(0), ())

    def and_also(self, *others: "Rows") -> "Rows":
        """Join bounds."""
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
        """Say if joint speeds (n,) are outside."""
        return exact.norm(self._off(velocities)) > self.radius * (1.0 - _EDGE)

    def cut(self, velocities: Floats) -> Rows:
        """Return the plane that touches the ball where joint speeds outside (n,) are nearest."""
        off = self._off(velocities)
        normal = off / exact.norm(off)
        most = exact.dot(normal, self.center) + self.radius * (1.0 - INSIDE)
        row = exact.product(normal, self.matrix)
        return Rows(row[None], np.full(1, -np.inf), np.array([most]), (self.reason,))

    def _off(self, velocities: Floats) -> Floats:
        return exact.product(self.matrix, velocities) - self.center


@dataclass(frozen=True, eq=False)
class Bounds:
    """All that bounds the hand's joints at one moment; `jacobian` (6, n) is the hand's.

    The window is kept in any case.
    """

    jacobian: Floats
    window: Window
    rows: Rows
    balls: tuple[Ball, ...]

    def hold(self, velocities: Floats) -> bool:
        """Say if joint speeds (n,) are inside."""
        window, rows = self.window, self.rows
        if not np.all((velocities >= window.lower) & (velocities <= window.upper)):
            return False  # so is what is no number
        if rows.reasons:
            values = exact.product(rows.matrix, velocities)
            if np.any((values < rows.lower) | (values > rows.upper)):
                return False
        return not any(ball.exceeds(velocities) for ball in self.balls)

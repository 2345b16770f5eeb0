"""Bounds on the joint speeds in one control period, each with its reason."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Balls, is_between
from servoid.pose import Floats, exact
from servoid.servo.keeping.safety import Reason


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
class Bounds:
    """All bounds on the hand's joints in one control period; `jacobian` (6, n) is the hand's.

    The window is a hard bound.
    """

    jacobian: Floats
    window: Window
    rows: Rows
    balls: Balls

    def hold(self, velocities: Floats) -> bool:
        """Return whether joint speeds (n,) are inside."""
        window, rows = self.window, self.rows
        if not is_between(velocities, window.lower, window.upper):
            return False  # also for values that are not finite
        if rows.reasons:
            values = exact.product(rows.matrix, velocities)
            if not is_between(values, rows.lower, rows.upper):
                return False
        return self.balls.hold(velocities)

"""Notices that a goal is out of reach, or that the arm cannot move the way to it."""

import numpy as np

from servoid.pose import Pose, exact
from servoid.servo.arm import Arm, Floats, JointState
from servoid.servo.keeping.safety import Reason
from servoid.servo.law.reach import stepped
from servoid.servo.settings import JointSettings

_CLOSE = 1e-3  # m and rad: so near to the goal joints hold the hand there
_STEPS = 3  # of the search for such joints, each tick
_ANEW = 40  # steps after which it begins anew where the arm is
_PATIENCE_S = 0.15  # after which what holds is told
_LOST = 0.03  # m/s or so of a desired velocity that a singular pose may swallow


class Reaching:
    """Seeks joints for the goal, a few steps each tick, and tells when none are found.

    What it tells has held for a while, so that one wild estimate says nothing.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        self._arm = arm
        self._free = slice(0, arm.joints.hand_count)
        self._weights = np.repeat([1.0, settings.angular_weight], 3)
        self._damped_below = settings.damped_below
        self._found: Floats | None = None
        self._sought = 0
        self._since: dict[Reason, float] = {}

    def forget(self) -> None:
        """Begin anew, after a time without a goal."""
        self._found = None
        self._since.clear()

    def reasons(
        self, state: JointState, jacobian: Floats, twist: Floats, world_from_goal: Pose
    ) -> frozenset[Reason]:
        """Return why the hand does not come to a goal, to which it would go by a `twist` (6,).

        `jacobian` is (6, n), of the hand's joints.
        """
        now = {
            Reason.UNREACHABLE: not self._holds(state.positions, world_from_goal),
            Reason.SINGULAR: self._swallowed(jacobian, twist) > _LOST,
        }
        self._since = {
            reason: self._since.get(reason, state.time_s) for reason, holds in now.items() if holds
        }
        return frozenset(
            reason
            for reason, since_s in self._since.items()
            if state.time_s - since_s > _PATIENCE_S
        )

    def _holds(self, positions: Floats, world_from_goal: Pose) -> bool:
        """Say if joints are known, not far from the last ones, that hold the hand at a goal."""
        if self._found is None or self._sought > _ANEW:
            self._found, self._sought = positions, 0
        for _ in range(_STEPS):
            self._found, error = stepped(self._arm, self._found, world_from_goal, self._free)
            if error < _CLOSE:
                self._sought = 0
                return True
        self._sought += _STEPS
        return False

    def _swallowed(self, jacobian: Floats, twist: Floats) -> float:
        """Return how much of a velocity lies in directions that the arm has nearly lost."""
        weighted = self._weights[:, None] * jacobian
        squares, axes = exact.eigh(exact.product(weighted, weighted.T))
        # An arm of fewer than six joints lacks directions everywhere.
        lacking = len(weighted) - min(weighted.shape)
        sizes = np.sqrt(np.maximum(squares, 0.0))
        lack = np.maximum(0.0, 1.0 - sizes / self._damped_below)
        parts = np.abs(exact.product(axes.T, self._weights * twist))
        return float((lack * parts)[lacking:].max())

"""Detects that a goal is out of reach, or that a singular arm cannot move towards it."""

from servoid._native import lost_speed
from servoid.pose import Floats, Pose
from servoid.servo.arm import Arm, JointState
from servoid.servo.keeping.safety import Reason
from servoid.servo.law.reach import stepped
from servoid.servo.settings import JointSettings

_CLOSE = 1e-3  # m and rad: distance below which joints count as a solution
_STEPS = 3  # search steps per period
_ANEW = 40  # steps after which the search restarts at the arm's positions
_PATIENCE_S = 0.15  # time after which a persistent state is reported
_LOST = 0.03  # m/s or so of a desired velocity that a singular pose may suppress


class Reaching:
    """Searches joints for the goal, some steps per period, and reports if none are found.

    It reports only what has persisted for a while, so that a single outlier has no effect.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        self._arm = arm
        self._free = slice(0, arm.joints.hand_count)
        self._weighing = settings.angular_weight, settings.damped_below
        self._found: Floats | None = None
        self._steps_taken = 0
        self._since: dict[Reason, float] = {}

    def forget(self) -> None:
        """Reset, after a time without a goal."""
        self._found = None
        self._since.clear()

    def reasons(
        self, state: JointState, jacobian: Floats, twist: Floats, world_from_goal: Pose
    ) -> frozenset[Reason]:
        """Return why the hand does not reach a goal, towards which its velocity is `twist` (6,).

        `jacobian` is (6, n), of the hand's joints.
        """
        now = {
            Reason.UNREACHABLE: not self._holds(state.positions, world_from_goal),
            Reason.SINGULAR: lost_speed(jacobian, twist, *self._weighing) > _LOST,
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
        """Return whether joints near the last ones are known that place the hand at a goal."""
        if self._found is None or self._steps_taken > _ANEW:
            self._found, self._steps_taken = positions, 0
        for _ in range(_STEPS):
            self._found, error = stepped(self._arm, self._found, world_from_goal, self._free)
            if error < _CLOSE:
                self._steps_taken = 0
                return True
        self._steps_taken += _STEPS
        return False

"""Gates estimates that the object cannot have reached, and accepts confirmed jumps."""

from enum import Enum
from typing import Protocol

from servoid._native import change_between
from servoid.pose import Pose, exact
from servoid.servo.settings import TargetSettings


class Timed(Protocol):
    """A pose of an object and its time."""

    @property
    def time_s(self) -> float:
        """Return when the images were taken."""
        ...

    @property
    def world_from_object(self) -> Pose:
        """Return the pose of the object."""
        ...


class GateResult(Enum):
    """The result of gating an estimate."""

    USED = "used"
    OUTDATED = "outdated"
    TELEPORT = "teleport"
    RESTARTED = "restarted"


class Jumps:
    """Counts estimates that an object cannot have reached, and accepts several that agree.

    The safety supervisor holds the arm according to `count`.
    """

    def __init__(self, settings: TargetSettings) -> None:
        self._settings = settings
        self._agreeing: list[Timed] = []
        self._count = 0

    @property
    def count(self) -> int:
        """Return the number of jumps since the last estimate without one."""
        return self._count

    def gate(self, expected: Pose, seen: Pose, elapsed: float, estimate: Timed) -> GateResult:
        """Decide whether an estimate is used, ignored, or restarts the filter.

        It arrived `elapsed` seconds after the last used one, where `expected` was predicted.
        """
        if self._can_reach(expected, seen, elapsed):
            self.clear()
            return GateResult.USED
        if self._agreeing:
            last = self._agreeing[-1]
            since = estimate.time_s - last.time_s
            if since <= 0.0:
                return GateResult.OUTDATED
            if not self._can_reach(last.world_from_object, estimate.world_from_object, since):
                self._agreeing.clear()
        self._agreeing.append(estimate)
        self._count += 1
        agree = len(self._agreeing) >= self._settings.agreeing
        return GateResult.RESTARTED if agree else GateResult.TELEPORT

    def clear(self) -> None:
        """Reset the count of jumps."""
        self._agreeing.clear()
        self._count = 0

    def _can_reach(self, before: Pose, after: Pose, elapsed: float) -> bool:
        settings = self._settings
        change = change_between(before, after)
        shift, turn = exact.norm(change[:3]), exact.norm(change[3:])
        return (
            shift <= settings.linear_jump + settings.linear_speed * elapsed
            and turn <= settings.angular_jump + settings.angular_speed * elapsed
        )

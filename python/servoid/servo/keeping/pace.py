"""Measures how often commands really come."""

from collections import deque

from servoid.servo.keeping.safety import Reason

_COMMANDS = 25  # over which the time between two is averaged
_LATE = 1.2  # mean number of periods between commands, from which on they are late
_GAP = 3.5  # periods without a command, as of a program that was stopped: nothing is measured


class Pace:
    """Measures the mean time between commands, in periods of the arm.

    An acceleration that each command changes by one period's share takes longer to build up, and a
    joint longer to stop, if commands come less often than the arm says.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._times: deque[float] = deque(maxlen=_COMMANDS + 1)

    def see(self, time_s: float) -> None:
        """Process the time of the state that a command follows."""
        if self._times and not 0.0 <= time_s - self._times[-1] <= _GAP * self._period_s:
            self._times.clear()
        self._times.append(time_s)

    @property
    def periods(self) -> float:
        """Return the mean time between commands in periods, 1 unless they are clearly late."""
        if len(self._times) <= _COMMANDS:
            return 1.0
        mean = (self._times[-1] - self._times[0]) / (_COMMANDS * self._period_s)
        return mean if mean > _LATE else 1.0

    @property
    def reasons(self) -> frozenset[Reason]:
        """Return what is to be told of it."""
        return frozenset({Reason.LATE}) if self.periods > 1.0 else frozenset()

"""Measures how often commands really come."""

from collections import deque

from servoid.servo.keeping.safety import Reason

_COMMANDS = 25  # over which the time between two is averaged
_LATE = 1.2  # mean number of periods between commands, from which on they are late
_CLEARLY = 1.5  # that number, of which fewer commands suffice
_FEW = 5
_GAP = 3.5  # periods without a command: a single one is that of a program that was stopped
_MOST = 50.0  # periods that count of such a gap
_RARE = 4.0  # periods between commands, on average or twice in a row, above which the hand is held


class Pace:
    """Measures the mean time between commands, in periods of the arm."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._gaps: deque[float] = deque(maxlen=_COMMANDS)
        self._last_s: float | None = None
        self._since_long = _COMMANDS  # commands since one came after a long time
        self.periods: float = 1.0
        """The mean time between commands in periods, 1 unless they are clearly late."""
        self.is_rare: bool = False
        """Whether commands come too rarely to brake an arm in time."""

    def see(self, time_s: float) -> None:
        """Process the time of the state that a command follows."""
        last_s, self._last_s = self._last_s, time_s
        if last_s is None:
            return
        gap = (time_s - last_s) / self._period_s
        is_long = gap > _GAP
        if gap < 0.0 or (is_long and self._since_long >= _COMMANDS):
            self._gaps.clear()
        else:
            self._gaps.append(min(gap, _MOST))
        self._since_long = 0 if is_long else self._since_long + 1
        self.periods = self._mean()
        newest = list(self._gaps)[-2:]
        self.is_rare = self.periods > _RARE or (len(newest) == 2 and min(newest) > _RARE)

    def _mean(self) -> float:
        count, total = len(self._gaps), sum(self._gaps)
        if count < _FEW or total < _COMMANDS:
            return 1.0
        mean = total / count
        return mean if mean > (_LATE if count == _COMMANDS else _CLEARLY) else 1.0

    @property
    def limiting(self) -> frozenset[Reason]:
        """Return what is to be told of commands that are late."""
        return frozenset({Reason.LATE}) if self.periods > 1.0 else frozenset()

    @property
    def holding(self) -> frozenset[Reason]:
        """Return why the hand is held: commands come too rarely."""
        return frozenset({Reason.LATE}) if self.is_rare else frozenset()

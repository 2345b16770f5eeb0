"""Reads the clock of the arm for all cameras of a live source, and notices when it went back."""

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Any

from servoid.errors import CaptureError
from servoid.source.device_clock import JUMP_S


@dataclass(frozen=True)
class HostTime:
    """A time on the arm's clock in seconds, and how often the clock had gone back before."""

    time_s: float
    jumps: int = 0


class HostClock:
    """Counts how often a clock went back by more than its reading may vary; thread-safe."""

    def __init__(self, clock: Callable[[], Any]) -> None:
        """Take a function that returns the time in seconds.

        Raises:
            CaptureError: it does not return a number.

        """
        self._clock, self._lock = clock, Lock()
        self._newest_s, self._jumps = -float("inf"), 0
        self._back_s = 0.0
        self.now()

    def now(self) -> HostTime:
        """Return the present time.

        Raises:
            CaptureError: the clock does not return a number.

        """
        with self._lock:
            time_s = self._clock()
            if not hasattr(time_s, "__float__"):
                raise CaptureError(
                    "the clock of Live must return a number of seconds, as time.monotonic does, "
                    f"but returned {time_s!r:.60}"
                )
            time_s = float(time_s)
            back_s = self._newest_s - time_s
            if back_s > JUMP_S:
                self._jumps, self._back_s, self._newest_s = self._jumps + 1, back_s, time_s
            self._newest_s = max(self._newest_s, time_s)
            return HostTime(time_s, self._jumps)

    def jump(self) -> str:
        """Return the last jump in words."""
        with self._lock:
            return f"the clock of Live went back by {self._back_s:.3g} s, and is now trusted again"

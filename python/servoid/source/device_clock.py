"""Maps the timestamps of a device's own clock to the arm's clock."""

from collections import deque

WINDOW_S = 10.0  # a clock with a 50 ppm error drifts half a millisecond in it
JUMP_S = 0.25  # more than a network delay, less than the jump of a clock that was set
_SURE_S = 0.5  # equal delays for this long mean that the clock was set back
_EQUAL_S = 0.1
_UNITS = ((1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"))
_ABOUT = 3.0  # times: of what a unit makes of the time between two images


class DeviceClock:
    """Estimates when, on the arm's clock, an image was taken that has a device's timestamp.

    An image arrives after it was taken, sometimes much later, but never earlier. So the smallest
    difference between arrival and timestamp among recent images is the offset of the clocks; any
    excess is delay. The returned times increase, and none is later than its image's arrival.
    """

    def __init__(self) -> None:
        self._differences: deque[tuple[float, float]] = deque()  # (arrival, arrival - stamp)
        self._offset_s = 0.0
        self._stamp_s: float | None = None
        self._late: tuple[float, float] | None = None  # (arrival, delay) of the first late image

    def time_s(self, stamp_s: float, arrival_s: float) -> tuple[float, str | None]:
        """Return when an image was taken, on the arm's clock, and any jump of its timestamp.

        `stamp_s` is on the device's clock, `arrival_s` on the arm's; arrivals increase. The jump is
        described in words, or None.
        """
        difference_s = arrival_s - stamp_s
        if self._stamp_s is None:
            jump, lowest_s = None, difference_s
        else:
            passed_s = stamp_s - self._stamp_s
            jump = self._jump(passed_s, arrival_s, difference_s - self._offset_s)
            # Keep half of the elapsed time, so that times increase though the offset decreases.
            lowest_s = self._offset_s - 0.5 * passed_s if jump is None else difference_s
        if jump is not None:
            self._differences.clear()
            self._late = None
        self._differences.append((arrival_s, difference_s))
        while self._differences[0][0] < arrival_s - WINDOW_S:
            self._differences.popleft()
        self._offset_s = max(lowest_s, min(difference for _, difference in self._differences))
        self._stamp_s = stamp_s
        return min(arrival_s, stamp_s + self._offset_s), jump

    def _jump(self, passed_s: float, arrival_s: float, delay_s: float) -> str | None:
        """Describe the jump of the device's clock since the last image; None if there was none."""
        if passed_s == 0.0:
            return "its clock stands still, so that its images count as taken when they came"
        if passed_s < 0.0:
            return f"its clock went back by {-passed_s:.3g} s, and is now trusted again"
        if delay_s < -JUMP_S:
            unit = _unit(passed_s, passed_s + delay_s)
            if unit is not None:
                return f"its stamps look like {unit}: they must be in seconds, or be left out"
            return f"its clock went ahead by {-delay_s:.3g} s, and is now trusted again"
        if delay_s <= JUMP_S:
            self._late = None
        elif self._late is None or abs(delay_s - self._late[1]) > _EQUAL_S:
            self._late = arrival_s, delay_s  # it may have waited in a queue
        elif arrival_s - self._late[0] > _SURE_S:
            return f"its clock was set back by {delay_s:.3g} s, and is now trusted again"
        return None


def _unit(stamped: float, passed_s: float) -> str | None:
    """Return the unit in which a device's clock seems to count; None if it is seconds."""
    near = (word for many, word in _UNITS if many / _ABOUT < stamped / passed_s < many * _ABOUT)
    return next(near, None) if passed_s > 0.0 else None

"""Maps the stamps of a device's own clock to the clock of the arm."""

from collections import deque

WINDOW_S = 10.0  # a quartz that is 50 ppm off drifts half a millisecond in it
JUMP_S = 0.25  # more than a network delays images, less than what a clock that was set is off by
_SURE_S = 0.5  # so long all images come equally late, and the clock must have been set back
_EQUAL_S = 0.1


class DeviceClock:
    """Says when, on the arm's clock, an image was taken that a device stamped by its own.

    An image arrives after it was taken, sometimes long after, never before. So the smallest
    difference between arrival and stamp among the last images is the offset of the clocks, and what
    is more is delay. Times increase, and none is after its image's arrival.
    """

    def __init__(self) -> None:
        self._differences: deque[tuple[float, float]] = deque()  # (arrival, arrival - stamp)
        self._offset_s = 0.0
        self._stamp_s: float | None = None
        self._late: tuple[float, float] | None = None  # (arrival, delay) of the first late image

    def time_s(self, stamp_s: float, arrival_s: float) -> tuple[float, str | None]:
        """Return when an image was taken, on the arm's clock, and how its stamp jumped, or None.

        `stamp_s` is on the device's clock, `arrival_s` on the arm's; arrivals increase.
        """
        difference_s = arrival_s - stamp_s
        if self._stamp_s is None:
            jump, lowest_s = None, difference_s
        else:
            passed_s = stamp_s - self._stamp_s
            jump = self._jump(passed_s, arrival_s, difference_s - self._offset_s)
            # Half of what has passed is left, so that times increase though the offset sinks.
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
        """Say how the device's clock jumped since the last image, None if it did not."""
        if passed_s <= 0.0:
            return f"its clock went back by {-passed_s:.3g} s, and is trusted anew"
        if delay_s < -JUMP_S:
            return f"its clock went ahead by {-delay_s:.3g} s, and is trusted anew"
        if delay_s <= JUMP_S:
            self._late = None
        elif self._late is None or abs(delay_s - self._late[1]) > _EQUAL_S:
            self._late = arrival_s, delay_s  # it may have waited in a queue
        elif arrival_s - self._late[0] > _SURE_S:
            return f"its clock was set back by {delay_s:.3g} s, and is trusted anew"
        return None

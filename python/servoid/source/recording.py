"""Plays a capture as if its cameras delivered it live."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from servoid._native import Camera
from servoid.capture import Capture
from servoid.errors import CaptureError
from servoid.source.instants import cameras_of, read_instants
from servoid.source.source import Instant


class Recording:
    """Implements `Source`: the observations of a capture arrive at their times.

    The first one was taken when the recording is created, on the given `clock`: a function that
    returns seconds, such as `time.monotonic` or that of a simulated arm. The camera poses are those
    of the capture. An image is read only when it is returned.
    """

    def __init__(
        self,
        capture: Capture,
        clock: Callable[[], float],
        *,
        rate_hz: float | None = None,
        latency_s: float = 0.0,
    ) -> None:
        """Start playing; `rate_hz` is for a capture without times, or for another speed.

        An observation arrives `latency_s` seconds after it was taken.

        Raises:
            CaptureError: there is no observation, no time, or times that do not increase.
            CameraError: a lens sees nothing of its image.

        """
        self._capture, self._clock, self._latency_s = capture, clock, latency_s
        self._cameras = cameras_of(capture)
        self._observations = capture.observations()
        self._times_s = clock() + _seconds(capture, rate_hz)
        self._next = 0

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras whose images are delivered."""
        return self._cameras

    @property
    def is_over(self) -> bool:
        """Return whether the last observation was returned."""
        return self._next == len(self._observations)

    def newest(self) -> Instant | None:
        """Return the newest observation that has arrived and was not yet returned, else None."""
        arrived = int(np.searchsorted(self._times_s + self._latency_s, self._clock(), side="right"))
        if arrived <= self._next:
            return None
        self._next, place = arrived, arrived - 1
        instant = next(read_instants(self._capture, [self._observations[place]]))
        return replace(instant, time_s=float(self._times_s[place]))


def _seconds(capture: Capture, rate_hz: float | None) -> np.ndarray:
    """Return the time (N,) of each observation in seconds from the first."""
    if len(capture) == 0:
        raise CaptureError(f"{capture.path} has no observation to play")
    if rate_hz is not None or capture.times_s is None:
        rate_hz = capture.rate_hz if rate_hz is None else rate_hz
        if rate_hz is None or not rate_hz > 0.0:
            raise CaptureError(
                f"{capture.path} has neither times nor a rate, or the rate is not positive; give "
                "rate_hz, such as 30.0"
            )
        return np.arange(len(capture)) / rate_hz
    times_s = np.array(capture.times_s, dtype=np.float64)
    back = np.flatnonzero(np.diff(times_s) <= 0.0)
    if len(back):
        at = int(back[0])
        raise CaptureError(
            f"{capture.path}: observation {at + 1} was taken at {times_s[at + 1]:g} s, which is "
            f"not after the one before, {times_s[at]:g} s; sort them, or give rate_hz"
        )
    return times_s - times_s[0]

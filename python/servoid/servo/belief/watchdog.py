"""Detects images that stop or freeze, and estimates that contradict the filter."""

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import change_between
from servoid.pose import Floats, Pose, exact
from servoid.servo.settings import SafetySettings
from servoid.source import Instant

_FITTING = 3  # consecutive estimates that are no outliers, after which a series ends
_QUICK_S, _SLOW_S = 1.0, 5.0  # time constants of the rotation error, and of its constant part
_USUAL_S = 20.0  # time constant of the target's usual rotation
_LONGEST_S = 0.1  # maximum time that one estimate represents
_LASTING = 0.2  # share of the whole rotation error that always counts
_SIGNIFICANT = 0.5  # share of the tracker's standard deviation above which the variable part counts
_CALM = 0.5  # share of the threshold below which the arm moves again
_ROWS = 4  # every fourth row suffices to distinguish images


def fingerprint(image: NDArray[np.uint8]) -> int:
    """Return a hash of an image."""
    return zlib.crc32(image[::_ROWS].tobytes())


@dataclass
class _Last:
    """The last image of a camera, the pose at which it first came, and its repetitions."""

    mark: int
    world_from_camera: Pose
    times: int = 1
    hangs: bool = False


class Watchdog:
    """Monitors the images of all cameras; a camera is frozen until its image changes."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._newest_s: float | None = None
        self._last: dict[int, _Last] = {}

    def see(self, instant: Instant) -> None:
        """Process the images of an observation."""
        if not instant.is_dark:
            self._newest_s = instant.time_s
        for place, (image, pose) in enumerate(
            zip(instant.images, instant.world_from_camera, strict=True)
        ):
            if image is not None:
                self._compare(place, fingerprint(image), pose)

    def hear_of_images(self, time_s: float) -> None:
        """Process the time of images that only the tracker has."""
        if np.isfinite(time_s):
            self._newest_s = time_s

    def is_stale(self, time_s: float) -> bool:
        """Return whether the newest image is too old at a time, or there is none."""
        return self._newest_s is None or time_s - self._newest_s > self._settings.coast_s

    @property
    def hangs(self) -> bool:
        """Return whether a camera moved but its image did not change for several observations."""
        return any(last.hangs for last in self._last.values())

    def _compare(self, place: int, mark: int, world_from_camera: Pose) -> None:
        last = self._last.get(place)
        if last is None or last.mark != mark:
            self._last[place] = _Last(mark, world_from_camera)
            return
        last.times += 1
        moved = np.abs(change_between(last.world_from_camera, world_from_camera)).max()
        enough = last.times >= self._settings.frozen_after
        last.hangs |= enough and bool(moved > self._settings.frozen_shift)


class Parting:
    """Monitors whether estimates contradict the filter.

    A single outlier is not significant; a series of them means that tracker or filter is wrong,
    whatever the confidence. The series ends with several consecutive estimates that are no
    outliers, as a single one may be chance.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self.clear()

    def see(self, time_s: float, *, is_odd: bool) -> None:
        """Process whether an estimate was an outlier."""
        self._fitting = 0 if is_odd else self._fitting + 1
        if self._fitting >= _FITTING:
            self.clear()
        if not is_odd:
            return
        if self._since_s is None:
            self._since_s = time_s
        self._lasts_s = time_s - self._since_s

    @property
    def is_reported(self) -> bool:
        """Return whether they have differed for long enough to report it."""
        return self._lasts_s >= self._settings.parted_s

    @property
    def holds(self) -> bool:
        """Return whether they have differed for twice as long, so that the arm must be held."""
        return self._lasts_s >= 2.0 * self._settings.parted_s

    def clear(self) -> None:
        """Reset: estimates and filter agree."""
        self._since_s: float | None = None
        self._lasts_s, self._fitting = 0.0, 0


class Drifting:
    """Monitors estimated rotations that the filter does not follow, by their effect on the goal.

    A constant rotation error is tolerated. If the error varies, the target rotates and its rotation
    is too uncertain to follow, or is not known at all. The arm is then held until the rotation is
    estimated as before, or with certainty.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._lever = 0.0
        self._time_s: float | None = None
        self._quick = self._slow = np.zeros(3)
        self._turned = self._usual = np.zeros(3)
        self._calm_s, self._spread = -np.inf, 0.0
        self.holds: bool = False

    def reach(self, lever: float) -> None:
        """Set the distance of the goal from the target's origin, in m."""
        self._lever = lever

    def see(self, time_s: float, off: Floats, spread: float, led: Floats | None = None) -> None:
        """Process the difference in rotation (3,) between an estimate and the filter, in rad.

        `spread` is its standard deviation according to the tracker, `led` (3,) the rotation of the
        filter's pose since the last certain estimate; None while estimates are certain.
        """
        if self._lever == 0.0:
            return  # there is no goal yet
        # After a gap, a single rotation counts no more than usual.
        elapsed = 0.0 if self._time_s is None else min(time_s - self._time_s, _LONGEST_S)
        if self._time_s is None:
            self._quick = self._slow = self._turned = self._usual = off
            self._spread = spread
        self._heed(off, led, elapsed)
        self._quick = _towards(self._quick, off, elapsed / _QUICK_S)
        self._slow = _towards(self._slow, off, elapsed / _SLOW_S)
        self._spread -= float(exact.expm1(-elapsed / _QUICK_S)) * (spread - self._spread)
        self._time_s = time_s
        most, departs = self._settings.adrift, self.departs
        if departs > most:
            self.holds = True
        if max(departs, self._lever * exact.norm(self._turned - self._usual)) > _CALM * most:
            self._calm_s = time_s
        self.holds &= time_s - self._calm_s < self._settings.calm_s

    def _heed(self, off: Floats, led: Floats | None, elapsed: float) -> None:
        """Smooth the estimated rotation error and, while nothing is held, its usual value."""
        if led is None:
            self._turned = self._usual = off
            return
        self._turned = _towards(self._turned, led + off, elapsed / _QUICK_S)
        if not self.holds:
            self._usual = _towards(self._usual, led + off, elapsed / _USUAL_S)

    @property
    def departs(self) -> float:
        """Return how far rotations that the filter does not follow would move the goal, in m."""
        off = exact.norm(self._quick)
        # The end of a constant error is no contradiction.
        new = min(off, exact.norm(self._quick - self._slow))
        new *= new > _SIGNIFICANT * self._spread
        return self._lever * max(new, _LASTING * off)


class Straying:
    """Monitors how far following an uncertain rotation has moved the goal since a certain one.

    The first rotation, of the target as it was modelled, counts as certain.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._well: Pose | None = None
        self.led: Floats | None = None  # (3,), since the last certain one; None while it is
        self._calm_s = -np.inf
        self.holds: bool = False

    def see(self, time_s: float, believed: Pose, lever: float, *, is_rough: bool) -> None:
        """Process the filter's pose of the target, and the distance of its goal from it, in m."""
        if not is_rough:
            self._well, self.led, self.holds = believed, None, False
            return
        if self._well is None:
            self._well = believed
        most = self._settings.adrift
        self.led = change_between(self._well, believed)[3:]
        astray = lever * exact.norm(self.led)
        if astray > most:
            self.holds = True
        if astray > _CALM * most:
            self._calm_s = time_s
        self.holds &= time_s - self._calm_s < self._settings.calm_s


def _towards(smoothed: Floats, value: Floats, times: float) -> Floats:
    """Return an exponentially smoothed value after some of its time constants."""
    return smoothed - exact.expm1(-times) * (value - smoothed)

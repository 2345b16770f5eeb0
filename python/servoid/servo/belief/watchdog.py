"""Notices images that stop or hang, and a target estimate that images contradict."""

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose, exact
from servoid.servo.arm import Floats
from servoid.servo.law.moving import change_between
from servoid.servo.settings import SafetySettings
from servoid.source.source import Instant

_FITTING = 3  # estimates in a row that are not odd after which belief and sight are the same
_QUICK_S, _SLOW_S = 1.0, 5.0  # over which turns are smoothed, and taken for what is always wrong
_USUAL_S = 20.0  # over which what is usual comes about
_LONGEST_S = 0.1  # for which one turn counts at most
_LASTING = 0.2  # share of that which counts
_TOLD = 0.5  # share of the standard deviation that the tracker gives its turns, above which all do
_CALM = 0.5  # share of what holds the arm, below which it moves again
_ROWS = 4  # every fourth row tells images apart


def fingerprint(image: NDArray[np.uint8]) -> int:
    """Return a number that images of different content hardly share."""
    return zlib.crc32(image[::_ROWS].tobytes())


@dataclass
class _Last:
    """What a camera delivered last, since where, and how often."""

    mark: int
    world_from_camera: Pose
    times: int = 1
    hangs: bool = False


class Watchdog:
    """Watches the images of all cameras; a camera that hangs does so until its image changes."""

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._newest_s: float | None = None
        self._last: dict[int, _Last] = {}

    def see(self, instant: Instant) -> None:
        """Look at the images of an observation."""
        if not instant.is_dark:
            self._newest_s = instant.time_s
        for place, (image, pose) in enumerate(
            zip(instant.images, instant.world_from_camera, strict=True)
        ):
            if image is not None:
                self._compare(place, fingerprint(image), pose)

    def is_stale(self, time_s: float) -> bool:
        """Say if the newest image was taken too long before a time, or there is none."""
        return self._newest_s is None or time_s - self._newest_s > self._settings.coast_s

    @property
    def hangs(self) -> bool:
        """Say if a camera moved but its image did not change for several observations."""
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
    """Watches what is believed of a target against what is seen of it.

    A single odd estimate says nothing, a series of them that one or the other is wrong, however
    sure the tracker is. It ends with a few in a row that are not odd: one alone may be chance.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self.clear()

    def see(self, time_s: float, *, is_odd: bool) -> None:
        """Take in whether an estimate was farther off than it and the belief explain."""
        self._fitting = 0 if is_odd else self._fitting + 1
        if self._fitting >= _FITTING:
            self.clear()
        if not is_odd:
            return
        if self._since_s is None:
            self._since_s = time_s
        self._lasts_s = time_s - self._since_s

    @property
    def is_told(self) -> bool:
        """Say if they are apart for long enough to tell."""
        return self._lasts_s >= self._settings.parted_s

    @property
    def holds(self) -> bool:
        """Say if they are apart for so long that the arm must not go by either: twice as long."""
        return self._lasts_s >= 2.0 * self._settings.parted_s

    def clear(self) -> None:
        """Begin anew: belief and sight are the same."""
        self._since_s: float | None = None
        self._lasts_s, self._fitting = 0.0, 0


class Drifting:
    """Watches turns of a target that are seen and not believed: how far they would move its goal.

    A tracker that has the same turn wrong all the time is borne. Where what it sees comes and goes,
    the target turns and its turn is told too badly to follow, or nobody knows how it is turned. So
    it stays until the turn is seen as before, or told well.
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
        """Take in how far the goal is from the target's origin, in m."""
        self._lever = lever

    def see(self, time_s: float, off: Floats, spread: float, led: Floats | None = None) -> None:
        """Take in by what turn (3,) an estimate was off what was believed, in rad.

        `spread` is the standard deviation of such turns, as the tracker says, `led` (3,) how far
        the belief has turned since the turn was told well; None while it is.
        """
        if self._lever == 0.0:
            return  # there is no goal yet
        # After a gap, one turn alone says no more than usual.
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
        """Smooth how the target is seen to be turned, and, while nothing is held, usually is."""
        if led is None:
            self._turned = self._usual = off
            return
        self._turned = _towards(self._turned, led + off, elapsed / _QUICK_S)
        if not self.holds:
            self._usual = _towards(self._usual, led + off, elapsed / _USUAL_S)

    @property
    def departs(self) -> float:
        """Return how far the goal would go with the turns that are not believed, in m."""
        off = exact.norm(self._quick)
        # What was always wrong and is so no more is no doubt.
        new = min(off, exact.norm(self._quick - self._slow))
        new *= new > _TOLD * self._spread
        return self._lever * max(new, _LASTING * off)


class Straying:
    """Watches how far a turn that is told roughly has led a goal from where it was told well.

    As told well counts the turn that was believed first, of the target as it was modelled.
    """

    def __init__(self, settings: SafetySettings) -> None:
        self._settings = settings
        self._well: Pose | None = None
        self.led: Floats | None = None  # (3,), the turn since it was told well; None while it is
        self._calm_s = -np.inf
        self.holds: bool = False

    def see(self, time_s: float, believed: Pose, lever: float, *, is_rough: bool) -> None:
        """Take in how a target is believed to be turned, and its goal's distance from it, in m."""
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
    """Return a smoothed value after so many of its time constants."""
    return smoothed - exact.expm1(-times) * (value - smoothed)

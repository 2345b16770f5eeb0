"""Measures how late joints follow their commands."""

from collections import deque

import numpy as np

from servoid.pose import Floats

STEP_S = 0.025
"""The interval between the rows in which a lag is measured, in s."""

WINDOW = 40
"""The number of rows over which motions are compared."""

_SPARE_S = 0.04  # beyond what is allowed for, from which on joints are told to be late
_ALIKE = 0.95  # correlation from which on a motion is that of the commands, only later
_PEAKED = 0.01  # by which it is less four rows earlier and later, or the motion tells no lag
_BESIDE = 4
_IN_A_ROW, _APART_S = 3, 0.04  # measurements that agree
_LEAST = 1e-3  # rad in a step, of the fastest joint: below that joints hardly move
_SLOW = 0.25  # of the fastest motion that told a lag: what is slower tells less, and no other one


class JointLag:
    """Compares the measured motion of joints with the commanded one at earlier times.

    The correlation of both is greatest at the lag: latency of the states plus time constant of the
    joints. Motion at constant speeds tells none.
    """

    def __init__(self, allowed_s: float) -> None:
        """Take the lag in s that is allowed for."""
        self._allowed_s = allowed_s
        self._newest: deque[float] = deque(maxlen=_IN_A_ROW)
        self._fastest = 0.0
        self.late_s: float = 0.0
        """The lag in s of joints that are later than allowed for, 0 if they are not."""

    def see(self, commanded: Floats, went: Floats) -> None:
        """Process rows of angles, commanded ones (K + WINDOW + 1, N) and measured (WINDOW + 1, N).

        Both end now, and K is the number of steps of the greatest lag.
        """
        steps = np.diff(went, axis=0)
        fastest = float(np.abs(steps).max())
        if fastest < max(_LEAST, _SLOW * self._fastest):
            return
        found_s = _lag_s(np.diff(commanded, axis=0), steps)
        if found_s is None:
            return
        self._fastest = max(self._fastest, fastest)
        self._newest.append(found_s)
        least, most = min(self._newest), max(self._newest)
        if len(self._newest) < _IN_A_ROW or most - least > _APART_S:
            return
        spare_s = 0.0 if self.late_s > 0.0 else _SPARE_S
        self.late_s = most if least > self._allowed_s + spare_s else 0.0


def _lag_s(told: Floats, went: Floats) -> float | None:
    """Return the lag in s of motions `went` (W, N) behind those `told` (K + W, N), None if unclear.

    Sums are over the rows first, so that they are the same on each platform.
    """
    count, size = len(told) - len(went), _square(went)
    alike = []
    for lag in range(count + 1):
        earlier = told[count - lag : len(told) - lag]
        together = _square(earlier) * size
        product = _sum(earlier * went)
        alike.append(product * abs(product) / together if together > 0.0 else 0.0)
    best = int(np.argmax(alike))
    before, after = max(best - _BESIDE, 0), best + _BESIDE
    if alike[best] < _ALIKE or after > count:
        return None
    if alike[best] - alike[after] < _PEAKED or (best and alike[best] - alike[before] < _PEAKED):
        return None
    if not best:
        return 0.0
    low, middle, high = alike[best - 1 : best + 2]
    bend = low - 2.0 * middle + high
    return STEP_S * (best + (0.5 * (low - high) / bend if bend < 0.0 else 0.0))


def _square(values: Floats) -> float:
    return _sum(values * values)


def _sum(values: Floats) -> float:
    return float(sum(values.sum(axis=0).tolist()))

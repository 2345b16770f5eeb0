"""Statistics of the responses of several runs: median and extremes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.pose.exact import Floats
from servoid_experiments.bode.response import ResponseRow
from servoid_experiments.stats import Spread, spread_of

HALF_POWER = 2.0**-0.5


@dataclass(frozen=True, eq=False)
class Band:
    """The median and the extremes over all runs, at each frequency, (L,) each."""

    middle: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, values: Floats) -> "Band":
        """Summarise values (n, L) of n runs."""
        return cls(np.median(values, axis=0), values.min(axis=0), values.max(axis=0))


@dataclass(frozen=True, eq=False)
class Bode:
    """A signal's response along an axis: `hz` (L,), amplitude ratio, and phase in degrees.

    A negative phase is a lag.
    """

    hz: Floats
    gain: Band
    phase_deg: Band
    gains: Floats
    phases_deg: Floats

    @classmethod
    def of(cls, rows: Sequence[ResponseRow], signal: str, axis: str) -> "Bode | None":
        """Collect the responses of runs, None if there are none."""
        answers = [answer for row in rows if (answer := row.answer(signal, axis)) is not None]
        if not answers:
            return None
        ratios = np.array([answer.ratio for answer in answers])
        gains = np.abs(ratios)
        # Slow motion is followed, so the phase starts near 0 and is never a full turn off.
        phases = np.degrees(np.unwrap(np.angle(ratios), axis=1))
        return cls(np.array(answers[0].hz), Band.of(gains), Band.of(phases), gains, phases)

    def phase_at(self, hz: float, sign: float = 1.0) -> Spread:
        """Return the phase in degrees at the nearest frequency; with a sign of -1 the lag."""
        return _spread(sign * self.phases_deg[:, self._nearest(hz)])

    def missed_at(self, hz: float) -> Spread:
        """Return the share of the object's motion that is missed at the nearest frequency."""
        place = self._nearest(hz)
        turns = np.exp(1j * np.radians(self.phases_deg[:, place]))
        return _spread(np.abs(self.gains[:, place] * turns - 1.0))

    @property
    def bandwidth_hz(self) -> Spread:
        """Return where the amplitude first falls 3 dB below that of the object."""
        return self._leaving((HALF_POWER, np.inf))

    @property
    def faithful_hz(self) -> Spread:
        """Return up to which frequency the amplitude is within 3 dB of the object's."""
        return self._leaving((HALF_POWER, 1.0 / HALF_POWER))

    @property
    def peak(self) -> Spread:
        """Return the largest amplitude ratio."""
        return _spread(self.gains.max(axis=1))

    @property
    def peak_hz(self) -> float:
        """Return the frequency at which the median is largest."""
        return float(self.hz[int(np.argmax(self.gain.middle))])

    @property
    def delay_s(self) -> Spread:
        """Return the delay that corresponds to the phases: the median over all frequencies."""
        return _spread(np.median(-self.phases_deg / (360.0 * self.hz), axis=1))

    def _nearest(self, hz: float) -> int:
        return int(np.argmin(np.abs(self.hz - hz)))

    def _leaving(self, bounds: tuple[float, float]) -> Spread:
        found = [leaving(self.hz, row, bounds) for row in self.gains]
        return _spread(np.array([np.inf if hz is None else hz for hz in found]))


def _spread(values: Floats) -> Spread:
    """Return the median and the extremes of values (n,) of n runs."""
    found = spread_of(values.tolist())
    assert found is not None, "no runs"
    return found


def leaving(hz: Floats, gains: Floats, bounds: tuple[float, float]) -> float | None:
    """Return where a gain (L,) first leaves its bounds, None if nowhere.

    Between two frequencies it is interpolated linearly in logarithms.
    """
    low, high = bounds
    outside = np.flatnonzero((gains < low) | (gains > high))
    if len(outside) == 0:
        return None
    after = int(outside[0])
    if after == 0:
        return float(hz[0])
    level = np.log(low if gains[after] < low else high)
    x, y = np.log(hz[after - 1 : after + 1]), np.log(gains[after - 1 : after + 1])
    return float(np.exp(x[0] + (x[1] - x[0]) * (level - y[0]) / (y[1] - y[0])))

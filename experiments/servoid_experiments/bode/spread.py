"""What many runs say together: the middle of their answers, and how far they lie apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.servo.arm import Floats
from servoid_experiments.bode.response import ResponseRow

HALF_POWER = 2.0**-0.5


@dataclass(frozen=True, eq=False)
class Band:
    """The median and the least and greatest of all runs, at each frequency, (L,) each.

    `sweeping.confidence` says how likely they hold the median of all possible runs.
    """

    middle: Floats
    low: Floats
    high: Floats

    @classmethod
    def of(cls, values: Floats) -> "Band":
        """Sum up values (n, L) of n runs."""
        return cls(np.median(values, axis=0), values.min(axis=0), values.max(axis=0))


@dataclass(frozen=True, eq=False)
class Bode:
    """A signal's answer along an axis: `hz` (L,), ratio of amplitudes, and phase in degrees.

    A negative phase is a lag.
    """

    hz: Floats
    gain: Band
    phase_deg: Band
    gains: Floats
    phases_deg: Floats

    @classmethod
    def of(cls, rows: Sequence[ResponseRow], signal: str, axis: str) -> "Bode | None":
        """Gather the answers of runs, None if there are none."""
        answers = [answer for row in rows if (answer := row.answer(signal, axis)) is not None]
        if not answers:
            return None
        ratios = np.array([answer.ratio for answer in answers])
        gains = np.abs(ratios)
        # What is slow is followed, so a phase begins near 0 and is never a turn off.
        phases = np.degrees(np.unwrap(np.angle(ratios), axis=1))
        return cls(np.array(answers[0].hz), Band.of(gains), Band.of(phases), gains, phases)

    def phase_at(self, hz: float) -> "Spread":
        """Return the phase in degrees at the nearest frequency."""
        place = int(np.argmin(np.abs(self.hz - hz)))
        return Spread.of(self.phases_deg[:, place].tolist())

    @property
    def bandwidth_hz(self) -> "Spread":
        """Return where the amplitude first falls to 3 dB below that of the object."""
        return Spread.of([leaving(self.hz, row, (HALF_POWER, np.inf)) for row in self.gains])

    @property
    def faithful_hz(self) -> "Spread":
        """Return up to where the amplitude is within 3 dB of that of the object."""
        bounds = (HALF_POWER, 1.0 / HALF_POWER)
        return Spread.of([leaving(self.hz, row, bounds) for row in self.gains])

    @property
    def peak(self) -> "Spread":
        """Return the greatest ratio of amplitudes."""
        return Spread.of(self.gains.max(axis=1).tolist())

    @property
    def peak_hz(self) -> float:
        """Return where the median is greatest."""
        return float(self.hz[int(np.argmax(self.gain.middle))])

    @property
    def delay_s(self) -> "Spread":
        """Return the delay that the phases amount to: the median over all frequencies."""
        return Spread.of(np.median(-self.phases_deg / (360.0 * self.hz), axis=1).tolist())


def leaving(hz: Floats, gains: Floats, bounds: tuple[float, float]) -> float | None:
    """Return where a gain (L,) first leaves its bounds, None if nowhere.

    Between two frequencies it goes straight in logarithms.
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


@dataclass(frozen=True)
class Spread:
    """The median and the least and greatest of a figure; None is beyond all that was tried."""

    middle: float | None
    low: float | None
    high: float | None

    @classmethod
    def of(cls, values: Sequence[float | None]) -> "Spread":
        """Sum up the values of runs, one or more."""
        known = np.array([np.inf if value is None else value for value in values])
        found = (float(np.median(known)), float(known.min()), float(known.max()))
        return cls(*(None if np.isinf(value) else value for value in found))

    def words(self, digits: int, scale: float = 1.0, beyond: str = "") -> str:
        """Say it as `median (least to greatest)`, where `beyond` stands for what is beyond."""
        middle, low, high = (
            beyond if value is None else f"{round(scale * value, digits) + 0.0:.{digits}f}"
            for value in (self.middle, self.low, self.high)
        )
        return middle if low == high else f"{middle} ({low} to {high})"


def in_short(value: float) -> str:
    """Return a number of 1 or more with two digits or more."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"

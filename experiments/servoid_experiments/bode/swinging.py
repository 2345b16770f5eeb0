"""An object that swings at many frequencies at once, and the amplitudes of a signal at each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.pose.exact import Floats

Complexes = NDArray[np.complex128]

_SOFT_S = 1.5  # over which the motion is faded in
_DRAWS = 300  # of phases; those with the lowest peak acceleration are used
_SAMPLES = 2000  # of a period, to find its peak


@dataclass(frozen=True, eq=False)
class Swing:
    """Sines at multiples of `base_hz`: value = sum of heights * cos(2 pi f t + phases).

    `lines` (L,) int64 are the multiples, `heights` (L,) in metres, `phases` (L,) in radians.
    """

    base_hz: float
    lines: NDArray[np.int64]
    heights: Floats
    phases: Floats

    @classmethod
    def of(
        cls,
        lines: Sequence[int],
        base_hz: float,
        *,
        speed: float,
        amplitude: float,
        seed: Sequence[int],
    ) -> "Swing":
        """Make a swing whose single sines do not exceed `speed` and `amplitude`.

        Of many phases that the seed draws, those with the lowest peak acceleration are used.
        """
        chosen = np.array(lines, dtype=np.int64)
        rates = 2.0 * math.pi * base_hz * chosen
        heights = np.minimum(amplitude, speed / rates)
        draws = np.random.default_rng(list(seed)).uniform(0.0, 2.0 * math.pi, (_DRAWS, len(chosen)))
        when = np.arange(_SAMPLES) / (_SAMPLES * base_hz)
        waves = np.exp(1j * np.outer(rates, when)) * (heights * rates**2)[:, None]
        peaks = np.abs((np.exp(1j * draws) @ waves).real).max(axis=1)
        return cls(base_hz, chosen, heights, draws[int(np.argmin(peaks))])

    def at(self, time_s: float) -> float:
        """Return the value at a time, in metres."""
        turns = 2.0 * math.pi * self.base_hz * self.lines * time_s
        return float(self.heights @ np.cos(turns + self.phases))


@dataclass(frozen=True, eq=False)
class Swinging:
    """A path of `servoid.sim.world`: two swings, to the right and away from the hand."""

    sideways: Swing
    depth: Swing

    def start_from_object(self, time_s: float) -> Pose:
        """Return the object's pose in its frame at the start."""
        share = min(max(time_s / _SOFT_S, 0.0), 1.0)
        soft = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        place = [soft * self.sideways.at(time_s), 0.0, soft * self.depth.at(time_s)]
        return Pose.from_parts(place, [1.0, 0.0, 0.0, 0.0])


def amplitudes(times: Floats, values: Floats, base_hz: float, most: int) -> Complexes:
    """Return (most, C): complex amplitudes of values (T, C) at the multiples 1 to `most`.

    A value is the sum of the real parts of amplitude * exp(i 2 pi f t), by least squares. The times
    (T,) should span whole periods of `base_hz`.
    """
    turns = 2.0 * math.pi * base_hz * np.outer(times, np.arange(1, most + 1))
    design = np.concatenate([np.ones((len(times), 1)), np.cos(turns), -np.sin(turns)], axis=1)
    found = np.linalg.lstsq(design, values, rcond=None)[0]
    return found[1 : most + 1] + 1j * found[most + 1 :]

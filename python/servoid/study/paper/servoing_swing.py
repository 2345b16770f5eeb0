"""How well something follows a swing: its amplitude and phase beside those of what it follows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# 97.5 % quantiles of Student's t for 1, 2, ... degrees of freedom.
_STUDENT = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
_NORMAL = 1.96


@dataclass(frozen=True)
class Response:
    """Amplitude ratio and phase lag in degrees of what follows; positive: it is late."""

    gain: float
    lag_deg: float


def swing(times: Floats, values: Floats, omega: float) -> complex:
    """Return the complex amplitude of values (N,) at times (N,): Re(c exp(i omega t)) + offset.

    It is that of least squares; `omega` is in rad/s.
    """
    turns = omega * times
    shape = np.stack([np.ones_like(times), np.cos(turns), np.sin(turns)], axis=1)
    _, cosine, sine = np.linalg.lstsq(shape, values, rcond=None)[0]
    return complex(cosine, -sine)


def unswung(times: Floats, values: Floats, omega: float) -> Floats:
    """Return what is left of values (N,) without offset and swing."""
    part = swing(times, values, omega)
    left = values - (part * np.exp(1j * omega * times)).real
    return left - left.mean()


def response(times: Floats, follower: Floats, followed: Floats, omega: float) -> Response:
    """Return how one series (N,) follows another at the same times (N,) in seconds."""
    ratio = swing(times, follower, omega) / swing(times, followed, omega)
    return Response(float(abs(ratio)), -math.degrees(math.atan2(ratio.imag, ratio.real)))


@dataclass(frozen=True)
class Interval:
    """A mean over seeds, and the half width of its 95 % interval; None with a single seed."""

    mean: float
    half: float | None

    def written(self, digits: int, unit: str = "") -> str:
        """Say it, such as `9.8 ± 0.1 mm`."""
        half = "" if self.half is None else f" ± {self.half:.{digits}f}"
        return f"{self.mean:.{digits}f}{half}{unit}"


def interval(values: Sequence[float]) -> Interval:
    """Return the mean of independent values and its interval by Student's t."""
    count = len(values)
    mean = float(np.mean(values))
    if count < 2:
        return Interval(mean, None)
    quantile = _STUDENT[count - 2] if count - 2 < len(_STUDENT) else _NORMAL
    return Interval(mean, quantile * float(np.std(values, ddof=1)) / math.sqrt(count))

"""How well something follows a swing: its amplitude and phase beside those of what it follows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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

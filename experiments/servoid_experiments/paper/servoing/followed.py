"""Measures how well a swinging object was recognised and followed, over whole periods."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from servoid.pose.exact import Floats

Triple = tuple[float, float, float]

_KEPT_S = 1.0 / 16.0  # between two recorded instants of a time course
_AXES = "xyz"


@dataclass(frozen=True)
class Response:
    """Amplitude ratio and phase lag in degrees of a follower; positive: it is late."""

    gain: float
    lag_deg: float


def swing(times: Floats, values: Floats, omega: float) -> complex:
    """Return the complex amplitude of values (N,) at times (N,): Re(c exp(i omega t)) + offset.

    It is the least-squares fit; `omega` is in rad/s.
    """
    turns = omega * times
    shape = np.stack([np.ones_like(times), np.cos(turns), np.sin(turns)], axis=1)
    _, cosine, sine = np.linalg.lstsq(shape, values, rcond=None)[0]
    return complex(cosine, -sine)


def unswung(times: Floats, values: Floats, omega: float) -> Floats:
    """Return the residual of values (N,) without offset and swing."""
    part = swing(times, values, omega)
    left = values - (part * np.exp(1j * omega * times)).real
    return left - left.mean()


def response(times: Floats, follower: Floats, followed: Floats, omega: float) -> Response:
    """Return how one series (N,) follows another at the same times (N,) in seconds."""
    ratio = swing(times, follower, omega) / swing(times, followed, omega)
    return Response(float(abs(ratio)), -math.degrees(math.atan2(ratio.imag, ratio.real)))


class Courses(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Time courses, in metres along the object's axes at its start; its start is the origin.

    `seconds` are counted from the start of the object's path, at which images were exposed. `hand`
    is relative to the hand's goal at the start, so that it equals the target if it follows without
    an error. `seen` is the recognised position of the object at that instant.
    """

    seconds: list[float]
    target_x: list[float]
    target_y: list[float]
    target_z: list[float]
    seen_x: list[float]
    seen_y: list[float]
    seen_z: list[float]
    hand_x: list[float]
    hand_y: list[float]
    hand_z: list[float]

    def along(self, what: str, axis: str) -> Floats:
        """Return one course (N,): of the target, seen or hand, along x, y or z."""
        return np.array(getattr(self, f"{what}_{axis}"))


class Followed(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Figures of whole periods of the swing, lengths in metres, triples along x, y and z.

    `gain` and `lag_deg` are amplitude ratio and phase lag in x relative to the object itself.
    `hand_jitter` is the standard deviation of the residual of the hand's course without its offset
    and swing. `seen_spread` is that of the recognition's error and `seen_worst` its largest
    magnitude. `x_by_z` is the correlation of the recognition's errors in x and in z.
    """

    hand_gain: float
    hand_lag_deg: float
    seen_gain: float
    seen_lag_deg: float
    hand_rms: Triple
    hand_offset: Triple
    hand_jitter: Triple
    seen_bias: Triple
    seen_spread: Triple
    seen_worst: Triple
    x_by_z: float
    z_spread_by_period: list[float]
    courses: Courses


@dataclass(frozen=True, eq=False)
class Track:
    """Positions in M0, (N, 3) each, at the times of the images, (N,) in seconds."""

    times: Floats
    target: Floats
    seen: Floats
    hand: Floats


def followed(track: Track, omega: float, settle_s: float, periods: int) -> Followed:
    """Measure whole periods of a swing along x in rad/s, after `settle_s`."""
    period_s = 2.0 * math.pi / omega
    measured = (track.times >= settle_s) & (track.times < settle_s + periods * period_s)
    times, target, seen, hand = (
        values[measured] for values in (track.times, track.target, track.seen, track.hand)
    )
    off, wrong = hand - target, seen - target
    follows = response(times, hand[:, 0], target[:, 0], omega)
    recognised = response(times, seen[:, 0], target[:, 0], omega)
    number = np.floor((times - settle_s) / period_s)
    return Followed(
        hand_gain=follows.gain,
        hand_lag_deg=follows.lag_deg,
        seen_gain=recognised.gain,
        seen_lag_deg=recognised.lag_deg,
        hand_rms=_triple(np.sqrt(np.mean(off**2, axis=0))),
        hand_offset=_triple(off.mean(axis=0)),
        hand_jitter=_triple([unswung(times, column, omega).std() for column in hand.T]),
        seen_bias=_triple(wrong.mean(axis=0)),
        seen_spread=_triple(wrong.std(axis=0)),
        seen_worst=_triple(np.abs(wrong).max(axis=0)),
        x_by_z=_correlation(wrong[:, 0], wrong[:, 2]),
        z_spread_by_period=[float(wrong[number == one, 2].std()) for one in range(periods)],
        courses=_courses(track),
    )


def _courses(track: Track) -> Courses:
    """Reduce the time courses to the resolution that a figure needs."""
    kept: list[int] = []
    for place, moment in enumerate(track.times):
        if not kept or moment - track.times[kept[-1]] >= _KEPT_S:
            kept.append(place)
    columns = {
        f"{name}_{axis}": _listed(getattr(track, name)[kept, place])
        for name in ("target", "seen", "hand")
        for place, axis in enumerate(_AXES)
    }
    return Courses(seconds=_listed(track.times[kept]), **columns)


def _correlation(one: Floats, other: Floats) -> float:
    """Return the correlation of two series (N,), 0 if one of them is constant."""
    scale = float(one.std() * other.std())
    shared = float(np.mean((one - one.mean()) * (other - other.mean())))
    return shared / scale if scale > 0.0 else 0.0


def _triple(values: Sequence[float] | Floats) -> Triple:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _listed(values: Floats) -> list[float]:
    return [round(float(value), 6) for value in values]

"""Estimates motion by a bank of Kalman filters (IMM) with correlated measurement errors."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.pose import Floats, exact


class MotionModel(Protocol):
    """A motion model, driven by white-noise jerk."""

    @property
    def jerk(self) -> float:
        """Return the density of the jerk, per s² and root s."""
        ...

    def moved(self, span: float) -> Floats:
        """Return (3, 3): what place, speed and acceleration become in a time."""
        ...


@dataclass(frozen=True)
class Singer:
    """A motion model whose acceleration decays with time constant `lasting_s` (Singer model).

    White-noise jerk drives it, of density `jerk` per s² and root s.
    """

    jerk: float
    lasting_s: float

    def moved(self, span: float) -> Floats:
        """Return (3, 3): what place, speed and acceleration become in a time."""
        return fading_acceleration(span, self.lasting_s)


@dataclass(frozen=True)
class Oscillation:
    """A motion model of an oscillation about any position, with period `period_s`."""

    jerk: float
    period_s: float

    def moved(self, span: float) -> Floats:
        """Return (3, 3): what place, speed and acceleration become in a time."""
        rate = 2.0 * math.pi / self.period_s
        along, across = exact.cos(rate * span), exact.sin(rate * span)
        return np.array(
            [
                [1.0, across / rate, (1.0 - along) / (rate * rate)],
                [0.0, along, across / rate],
                [0.0, -rate * across, along],
            ]
        )


@dataclass(frozen=True)
class MotionPrior:
    """The expected kinds of motion, and the correlation time of estimation errors.

    At rest, the position is a random walk of `rest` per root s; in motion, it follows one of
    several models. Each mode lasts about `change_s`. Errors that estimates share decay with
    `lasting_s`.
    """

    rest: float
    models: tuple[MotionModel, ...]
    change_s: float
    lasting_s: float


@dataclass(frozen=True, eq=False)
class Noise:
    """The uncertainty of an estimate.

    `fresh` is the covariance (n, n) of errors that are independent in each estimate, `lasting` the
    standard deviation, along any axis, of errors that successive estimates share. Earlier shared
    errors decay within `fading_s`, faster than new ones arise if the estimates have become certain.
    """

    fresh: Floats
    lasting: float
    fading_s: float


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measurement of a motion: `matrix` (k, 4 n) times its state, with covariance (k, k)."""

    matrix: Floats
    spread: Floats

    @classmethod
    def along(cls, axes: Floats, noise: Noise) -> "Measurement":
        """Return the measurement of an estimate along axes (k, n): position plus shared error."""
        still = np.zeros_like(axes)
        matrix = np.concatenate([axes, still, still, axes], axis=1)
        return cls(matrix, exact.product(axes, noise.fresh, axes.T))

    @classmethod
    def of_place(cls, axes: Floats, spread: Floats) -> "Measurement":
        """Return a measurement of the position along axes (k, n), of covariance `spread` (n, n)."""
        still = np.zeros((len(axes), 3 * axes.shape[1]))
        return cls(np.concatenate([axes, still], axis=1), exact.product(axes, spread, axes.T))

    def and_resting(self, axes: Floats, speed: float) -> "Measurement":
        """Add the pseudo-measurement of zero speed along axes (m, n), of deviation `speed`."""
        still = np.zeros_like(axes)
        rests = np.concatenate([still, axes, still, still], axis=1)
        count, whole = len(self.spread), np.eye(len(self.spread) + len(axes)) * speed * speed
        whole[:count, :count] = self.spread
        return Measurement(np.concatenate([self.matrix, rests]), whole)


class Motion:
    """Coordinates (n,), their speed and acceleration, and the shared error of estimates.

    Kalman filters, one for rest and one for each motion model, are weighted by their likelihood:
    interacting multiple models. The state (4 n,) of each is (offset, speed, acceleration, shared
    error of estimates), and offsets are relative to a reference that `settle` moves.
    """

    def __init__(self, prior: MotionPrior, noise: Noise, spread: tuple[float, float]) -> None:
        """Initialise with an estimate at the reference.

        `spread` contains the initial standard deviations of speed and acceleration.
        """
        self._prior, self._noise, self._n = prior, noise, len(noise.fresh)
        n, modes = self._n, 1 + len(prior.models)
        covariances = np.zeros((modes, 4 * n, 4 * n))
        each = np.eye(n)
        lasting = noise.lasting * noise.lasting * each
        covariances[:, :n, :n] = noise.fresh + lasting
        covariances[:, 3 * n :, 3 * n :] = lasting
        covariances[:, :n, 3 * n :] = covariances[:, 3 * n :, :n] = -lasting
        covariances[1:, n : 3 * n, n : 3 * n] = np.kron(np.diag(np.square(spread)), each)
        self._weights = np.full(modes, 1.0 / modes)
        self._states, self._covariances = np.zeros((modes, 4 * n)), covariances

    @property
    def going(self) -> float:
        """Return the probability of motion, 0 to 1."""
        return float(self._weights[1:].sum())

    def ahead(self, span: float) -> tuple[Floats, Floats]:
        """Predict state (4 n,) and covariance (4 n, 4 n) at a time after the newest estimate."""
        states, covariances = np.empty_like(self._states), np.empty_like(self._covariances)
        for mode, (step, drive) in enumerate(zip(*self._steps(span), strict=True)):
            states[mode] = exact.product(step, self._states[mode])
            moved = exact.product(step, self._covariances[mode], step.T)
            covariances[mode] = moved + drive
        return _joined(self._weights, states, covariances)

    def advance(self, elapsed: float, noise: Noise) -> None:
        """Advance all filters to the time of an estimate with the given noise."""
        self._noise = noise
        self._mix(elapsed)
        for mode, (step, drive) in enumerate(zip(*self._steps(elapsed), strict=True)):
            self._states[mode] = exact.product(step, self._states[mode])
            moved = exact.product(step, self._covariances[mode], step.T)
            self._covariances[mode] = moved + drive

    def correct(self, measurement: "Measurement", innovation: Floats, nis_gate: float) -> float:
        """Correct by a measurement, given as its offset (k,) from the value at the reference.

        Return the normalised innovation squared (NIS) of the filter that fits better; beyond
        `nis_gate` the measurement is down-weighted.
        """
        look, spread = measurement.matrix, measurement.spread
        gaps = innovation - exact.product(self._states, look.T)
        shared = [exact.product(look, one) for one in self._covariances]
        known = [exact.product(one, look.T) for one in shared]
        nis = min(_squared(one + spread, gap) for one, gap in zip(known, gaps, strict=True))
        spread = spread * max(1.0, nis / nis_gate)
        scores = np.empty(len(self._weights))
        for mode, (gap, part) in enumerate(zip(gaps, shared, strict=True)):
            whole = known[mode] + spread
            scores[mode] = -0.5 * (_squared(whole, gap) + _log_determinant(whole))
            gain = exact.solve(whole, part).T
            self._states[mode] += exact.product(gain, gap)
            left = self._covariances[mode] - exact.product(gain, part)
            self._covariances[mode] = 0.5 * (left + left.T)
        shares = [exact.exp(float(score)) for score in scores - scores.max()]
        weights = self._weights * np.array(shares)
        self._weights = weights / weights.sum()
        return nis

    def inflate(self, unknown: Floats) -> None:
        """Add a covariance (n, n) to that of the offset."""
        self._covariances[:, : self._n, : self._n] += unknown

    def settle(self) -> Floats:
        """Move the reference to the estimated position; return the shift, (n,)."""
        moved = exact.product(self._weights, self._states[:, : self._n])
        self._states[:, : self._n] -= moved
        return moved

    def _mix(self, elapsed: float) -> None:
        """Mix the filters' states by the transition probabilities."""
        others = len(self._weights) - 1
        changed = -exact.expm1(-(1.0 + 1.0 / others) * elapsed / self._prior.change_s)
        changed /= 1.0 + others
        change = np.full((1 + others, 1 + others), changed)
        change[np.diag_indices(1 + others)] = 1.0 - others * changed
        shares = change * self._weights[:, None]
        self._weights = shares.sum(axis=0)
        shares = (shares / self._weights).T
        mixed = [_joined(share, self._states, self._covariances) for share in shares]
        self._states = np.array([state for state, _ in mixed])
        self._covariances = np.array([covariance for _, covariance in mixed])

    def _steps(self, span: float) -> tuple[Floats, Floats]:
        """Return transition and process noise of each filter, (modes, 4 n, 4 n) both."""
        prior, noise = self._prior, self._noise
        goes, driven = np.zeros((2, len(self._weights), 4, 4))
        goes[0, 0, 0] = 1.0
        goes[:, 3, 3] = exact.exp(-span / noise.fading_s)
        driven[0, 0, 0] = prior.rest * prior.rest * span
        comes = -exact.expm1(-2.0 * span / prior.lasting_s)
        driven[:, 3, 3] = comes * noise.lasting * noise.lasting
        jerked = white_jerk(span)
        for mode, model in enumerate(prior.models, start=1):
            goes[mode, :3, :3] = model.moved(span)
            driven[mode, :3, :3] = model.jerk * model.jerk * jerked
        return self._each(goes), self._each(driven)

    def _each(self, models: Floats) -> Floats:
        """Expand matrices of one coordinate (modes, 4, 4) to all, (modes, 4 n, 4 n)."""
        whole = np.zeros((len(models), 4, self._n, 4, self._n))
        for place in range(self._n):
            whole[:, :, place, :, place] = models
        return whole.reshape(-1, 4 * self._n, 4 * self._n)


def fading_acceleration(span: float, lasting_s: float) -> Floats:
    """Return the transition (3, 3) of position, speed and decaying acceleration."""
    share = span / lasting_s
    left = exact.exp(-share)
    gained = -exact.expm1(-share)
    return np.array(
        [
            [1.0, span, lasting_s * lasting_s * (share - gained)],
            [0.0, 1.0, lasting_s * gained],
            [0.0, 0.0, left],
        ]
    )


def _joined(weights: Floats, states: Floats, covariances: Floats) -> tuple[Floats, Floats]:
    """Return mean and covariance of a mixture of Gaussians."""
    mean = exact.product(weights, states)
    apart = states - mean
    spread = (weights[:, None, None] * covariances).sum(axis=0)
    return mean, spread + exact.product((weights[:, None] * apart).T, apart)


def _squared(covariance: Floats, gap: Floats) -> float:
    return exact.dot(gap, exact.solve(covariance, gap))


def _log_determinant(matrix: Floats) -> float:
    values, _ = exact.eigh(matrix)
    return float(sum(exact.log(float(value)) for value in values))


def white_jerk(elapsed: float) -> Floats:
    """Return the covariance (3, 3) of position, speed and acceleration by unit white jerk."""
    powers = np.cumprod(np.full(5, elapsed))
    return np.array(
        [
            [powers[4] / 20.0, powers[3] / 8.0, powers[2] / 6.0],
            [powers[3] / 8.0, powers[2] / 3.0, powers[1] / 2.0],
            [powers[2] / 6.0, powers[1] / 2.0, powers[0]],
        ]
    )

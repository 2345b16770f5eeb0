"""How something goes: a bank of Kalman filters for three coordinates whose estimates err alike."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.pose import exact
from servoid.servo.arm import Floats


class Way(Protocol):
    """A way to go, driven by a white jerk."""

    @property
    def jerk(self) -> float:
        """Return its density, per s² and root s."""
        ...

    def moved(self, span: float) -> Floats:
        """Return (3, 3): what place, speed and acceleration become in a time."""
        ...


@dataclass(frozen=True)
class Going:
    """A way to go: an acceleration that forgets itself within `lasting_s`.

    A white jerk drives it, of density `jerk` per s² and root s.
    """

    jerk: float
    lasting_s: float

    def moved(self, span: float) -> Floats:
        """Return (3, 3): what place, speed and acceleration become in a time."""
        return fading_acceleration(span, self.lasting_s)


@dataclass(frozen=True)
class Swinging:
    """A way to go: to and fro about any place, once in `period_s`, driven likewise."""

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
class Manner:
    """What motion is expected, and how long the error of an estimate lasts.

    What rests wanders by `rest` per root s; what goes does so in one of some ways. Each manner
    lasts about `change_s`. An error that estimates share comes and goes within `lasting_s`.
    """

    rest: float
    ways: tuple[Way, ...]
    change_s: float
    lasting_s: float


@dataclass(frozen=True, eq=False)
class Noise:
    """How far an estimate may be off.

    `fresh` is a covariance (n, n) that is new in each estimate, `lasting` the standard deviation,
    along any axis, of what those that follow one another share. What they had wrong until then
    fades within `fading_s`, sooner than it comes where they have become sure.
    """

    fresh: Floats
    lasting: float
    fading_s: float


@dataclass(frozen=True, eq=False)
class Seen:
    """What is seen of a motion: `matrix` (k, 4 n) times its state, with the covariance (k, k)."""

    matrix: Floats
    spread: Floats

    @classmethod
    def along(cls, axes: Floats, noise: Noise) -> "Seen":
        """Say what an estimate shows along axes (k, n): where it is, and by how much it errs."""
        still = np.zeros_like(axes)
        matrix = np.concatenate([axes, still, still, axes], axis=1)
        return cls(matrix, exact.product(axes, noise.fresh, axes.T))

    @classmethod
    def of_place(cls, axes: Floats, spread: Floats) -> "Seen":
        """Say where it is along axes (k, n), by what no estimate says; `spread` is (n, n)."""
        still = np.zeros((len(axes), 3 * axes.shape[1]))
        return cls(np.concatenate([axes, still], axis=1), exact.product(axes, spread, axes.T))

    def and_resting(self, axes: Floats, speed: float) -> "Seen":
        """Add the supposition that nothing moves along axes (m, n), but for some speed."""
        still = np.zeros_like(axes)
        rests = np.concatenate([still, axes, still, still], axis=1)
        count, whole = len(self.spread), np.eye(len(self.spread) + len(axes)) * speed * speed
        whole[:count, :count] = self.spread
        return Seen(np.concatenate([self.matrix, rests]), whole)


class Motion:
    """Coordinates (n,), their speed and acceleration, and what estimates have wrong just now.

    Kalman filters, of what rests and of each way to go, are weighed by how well each foresees what
    comes: interacting multiple models. The state (4 n,) of each is (offset, speed, acceleration,
    shared error of estimates), and offsets are from a reference that `settle` moves.
    """

    def __init__(self, manner: Manner, noise: Noise, spread: tuple[float, float]) -> None:
        """Begin with an estimate at the reference.

        Nothing is known of its motion but standard deviations, `spread`, of speed and acceleration.
        """
        self._manner, self._noise, self._n = manner, noise, len(noise.fresh)
        n, modes = self._n, 1 + len(manner.ways)
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
        """Return how likely it goes, 0 to 1."""
        return float(self._weights[1:].sum())

    def ahead(self, span: float) -> tuple[Floats, Floats]:
        """Return state (4 n,) and covariance (4 n, 4 n) so long after the newest estimate."""
        states, covariances = np.empty_like(self._states), np.empty_like(self._covariances)
        for mode, model in enumerate(self._models(span)):
            step, drive = (self._each(part) for part in model)
            states[mode] = exact.product(step, self._states[mode])
            moved = exact.product(step, self._covariances[mode], step.T)
            covariances[mode] = moved + drive
        return _joined(self._weights, states, covariances)

    def advance(self, elapsed: float, noise: Noise) -> None:
        """Go on to an estimate that may be so far off."""
        self._noise = noise
        self._mix(elapsed)
        for mode, model in enumerate(self._models(elapsed)):
            step, drive = (self._each(part) for part in model)
            self._states[mode] = exact.product(step, self._states[mode])
            moved = exact.product(step, self._covariances[mode], step.T)
            self._covariances[mode] = moved + drive

    def correct(self, seen: "Seen", innovation: Floats, nis_gate: float) -> float:
        """Take in what was seen, (k,) off what it would be at the reference.

        Return the normalised innovation squared (NIS) of the filter that fits better; beyond
        `nis_gate` what was seen loses weight.
        """
        look, spread = seen.matrix, seen.spread
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

    def loosen(self, unknown: Floats) -> None:
        """Add a covariance (n, n) to what is known of the offset."""
        self._covariances[:, : self._n, : self._n] += unknown

    def settle(self) -> Floats:
        """Move the reference to where it is believed to be; return by how much, (n,)."""
        moved = exact.product(self._weights, self._states[:, : self._n])
        self._states[:, : self._n] -= moved
        return moved

    def _mix(self, elapsed: float) -> None:
        """Let each filter begin with what both know, by how likely one became the other."""
        others = len(self._weights) - 1
        changed = -exact.expm1(-(1.0 + 1.0 / others) * elapsed / self._manner.change_s)
        changed /= 1.0 + others
        change = np.full((1 + others, 1 + others), changed)
        change[np.diag_indices(1 + others)] = 1.0 - others * changed
        shares = change * self._weights[:, None]
        self._weights = shares.sum(axis=0)
        shares = (shares / self._weights).T
        mixed = [_joined(share, self._states, self._covariances) for share in shares]
        self._states = np.array([state for state, _ in mixed])
        self._covariances = np.array([covariance for _, covariance in mixed])

    def _models(self, span: float) -> list[tuple[Floats, Floats]]:
        """Return how one coordinate moves on and what drives it, (4, 4) each, in each filter."""
        manner, noise = self._manner, self._noise
        fades = exact.exp(-span / noise.fading_s)
        comes = -exact.expm1(-2.0 * span / manner.lasting_s) * noise.lasting * noise.lasting
        rests = np.diag([1.0, 0.0, 0.0, fades])
        models = [(rests, np.diag([manner.rest * manner.rest * span, 0.0, 0.0, comes]))]
        for way in manner.ways:
            goes, driven = np.diag([0.0, 0.0, 0.0, fades]), np.diag([0.0, 0.0, 0.0, comes])
            goes[:3, :3] = way.moved(span)
            driven[:3, :3] = way.jerk * way.jerk * white_jerk(span)
            models.append((goes, driven))
        return models

    def _each(self, model: Floats) -> Floats:
        """Return what does to all coordinates (4 n, 4 n) what a model (4, 4) does to one."""
        whole = np.zeros((4, self._n, 4, self._n))
        for place in range(self._n):
            whole[:, place, :, place] = model
        return whole.reshape(4 * self._n, 4 * self._n)


def fading_acceleration(span: float, lasting_s: float) -> Floats:
    """Return (3, 3): what place, speed and acceleration become if the last one fades."""
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
    """Return mean and covariance of a mixture."""
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
    """Return (3, 3): covariance of position, speed and acceleration by a white jerk of one."""
    powers = np.cumprod(np.full(5, elapsed))
    return np.array(
        [
            [powers[4] / 20.0, powers[3] / 8.0, powers[2] / 6.0],
            [powers[3] / 8.0, powers[2] / 3.0, powers[1] / 2.0],
            [powers[2] / 6.0, powers[1] / 2.0, powers[0]],
        ]
    )

"""Filters the estimates of a tracked object, and predicts its present pose and motion."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from servoid._native import (
    Measurement,
    Motion,
    MotionModel,
    MotionPrior,
    Noise,
    certain_twist,
    change_between,
    predicted_motion,
    shifted_and_turned,
    spread_at,
)
from servoid.errors import ServoError
from servoid.pose import Floats, Pose, exact
from servoid.servo.belief.jumps import GateResult, Jumps
from servoid.servo.belief.unobservable_turns import UnobservableTurns, UnsureEstimate
from servoid.servo.settings import TargetSettings

# Initial standard deviations of an object's motion: m/s and m/s², rad/s and rad/s².
_START_SPREAD = ((0.3, 0.2), (1.0, 1.0))
_HARDLY = 0.05  # probability of error below which a tracker counts as certain
_SOONEST_S = 0.5  # minimum decay time of the rotation error of uncertain estimates
_FRESHEST = 0.003  # m: maximum standard deviation of the independent position error
_TINY = 1e-12  # m²
_OPEN_SPEED = 0.05  # rad/s: standard deviation of an unobservable angular velocity
_OPEN_WANDER = 0.1  # rad per root s: random walk of an unobservable rotation
_TURNED = 0.2  # rad: standard deviation, about any axis, of a rotation during a gap
_LEAST_DOUBT = 1e-3
_SURER = 0.5  # ratio of probabilities of error below which a later estimate replaces the first


class TargetEstimate(UnsureEstimate, Protocol):
    """The part of a tracker's estimate that servoing needs."""

    @property
    def time_s(self) -> float:
        """Return the time at which the images were taken."""
        ...

    @property
    def confidence(self) -> float:
        """Return the probability that the pose is right, 0 to 1."""
        ...

    @property
    def status(self) -> str:
        """Return `tracking`, `searching` or `lost`."""
        ...

    @property
    def located(self) -> bool:
        """Return whether the images confirm the position, though maybe not the rotation."""
        ...


@dataclass(frozen=True, eq=False)
class Prediction:
    """The predicted pose at a time; `twist` and `acceleration` are (6,), in the world.

    Their linear parts are those of the object's origin. `covariance` (6, 6) is that of a small
    translation and rotation in the world, 0 about unobservable axes, and `twist_covariance` (6, 6)
    that of the twist.
    """

    time_s: float
    world_from_object: Pose
    twist: Floats
    acceleration: Floats
    covariance: Floats
    twist_covariance: Floats

    @property
    def place(self) -> Floats:
        """Return the position of the object's origin in the world, (3,)."""
        return np.array(self.world_from_object.translation)

    @classmethod
    def at_rest(cls, time_s: float, world_from_object: Pose) -> "Prediction":
        """Return the prediction for an object at a known pose at rest."""
        still, sure = np.zeros(6), np.zeros((6, 6))
        return cls(time_s, world_from_object, still, still, sure, sure)

    def led(self, lead_s: float, linear: float, angular: float) -> "Prediction":
        """Return the present pose with the motion after a time, as far as it is certain.

        The twist is shortened if its deviations exceed the given ones, in m/s and rad/s.
        """
        motion = self.twist, self.acceleration, self.twist_covariance
        return replace(self, twist=certain_twist(motion, lead_s, (linear, angular)))

    def spread_at(self, point: Floats) -> float:
        """Return the standard deviation, in m, of a world point (3,) fixed to the object."""
        return spread_at(self.covariance, point - self.place)


class TargetFilter:
    """Estimates pose and motion of an object from estimates with correlated errors.

    Translation and rotation about the object's origin, in the world, have a `Motion` each. Outliers
    are down-weighted; `Jumps` gates estimates that the object cannot have reached.
    """

    def __init__(self, settings: TargetSettings) -> None:
        self._settings = settings
        self._priors = _priors(settings)
        self._jumps = Jumps(settings)
        self._time_s: float | None = None
        self._pose = Pose.identity()
        self._known: _Known | None = None
        self._odd = False
        self._turn_off: Floats | None = None
        self._begun: _Begun | None = None

    @property
    def time_s(self) -> float | None:
        """Return the time of the last used estimate, None before the first."""
        return self._time_s

    @property
    def jumps(self) -> int:
        """Return the number of jumps since the last estimate that the object could have reached."""
        return self._jumps.count

    @property
    def is_odd(self) -> bool:
        """Return whether the last used estimate was an outlier."""
        return self._odd

    @property
    def turn_off(self) -> Floats | None:
        """Return the rotation (3,) in the world from the filter to the last used estimate.

        Rotations about unobservable axes are left out. None for the first estimate after a start.
        """
        return self._turn_off

    def update(self, estimate: TargetEstimate) -> GateResult:
        """Process an estimate; estimates must be in the order of their times."""
        known = self._known
        if self._time_s is None or known is None:
            self._start(estimate)
            return GateResult.USED
        elapsed = estimate.time_s - self._time_s
        if elapsed <= 0.0:
            return GateResult.OUTDATED
        expected = self._after(known, min(elapsed, self._settings.horizon_s))
        seen = UnobservableTurns.of(estimate).with_expected(expected, estimate.world_from_object)
        result = self._jumps.gate(expected, seen, elapsed, estimate)
        if result is GateResult.RESTARTED:
            self._start(estimate)
        if result is GateResult.USED:
            if self._begun is not None and self._begun.is_outdone(estimate):
                self._start(estimate, self._begun)
            else:
                self._follow(known, estimate, elapsed)
        return result

    def predict(self, time_s: float) -> Prediction:
        """Predict the object at a time; beyond `horizon_s` it is assumed to be at rest.

        Without compensation of delays, return its pose in the last images.

        Raises:
            ServoError: there was no estimate yet.

        """
        if self._time_s is None or self._known is None:
            raise ServoError("no estimate has come yet; call update before predict")
        ahead, horizon = time_s - self._time_s, self._settings.horizon_s
        span = min(max(ahead, 0.0), horizon) if self._settings.compensate else 0.0
        change, twist, acceleration, *spreads = self._known.ahead(span)
        rests = ahead > horizon
        return Prediction(
            time_s,
            shifted_and_turned(self._pose, change),
            np.zeros(6) if rests else twist,
            np.zeros(6) if rests else acceleration,
            *spreads,
        )

    def forget(self) -> None:
        """Drop position and motion, so that the next estimate restarts the filter.

        The rotation is kept: exactly about unobservable axes, otherwise as a prior.
        """
        self._time_s = None
        self._jumps.clear()

    def _after(self, known: "_Known", elapsed: float) -> Pose:
        """Return the pose of the object at a time after the last used estimate."""
        return shifted_and_turned(self._pose, known.ahead(elapsed)[0])

    def _start(self, estimate: TargetEstimate, begun: "_Begun | None" = None) -> None:
        """Start with an estimate, or restart with one that replaces the first."""
        seen, turns = estimate.world_from_object, UnobservableTurns.of(estimate)
        if begun is None and self._known is not None:
            begun = _Begun(estimate.time_s, 1.0, self._known, self._pose)
        doubt = max(_LEAST_DOUBT, _doubt(estimate))
        self._begun = begun = None if begun is None else replace(begun, doubt=doubt)
        if begun is not None:
            # Otherwise the hand would move around a plain bottle that is found at another angle.
            seen = turns.with_expected(begun.was, seen)
        self._time_s, self._pose, self._odd = estimate.time_s, seen, False
        self._turn_off = None
        noises, hidden = self._noise(estimate)
        shift, turn = (
            Motion(*begin) for begin in zip(self._priors, noises, _START_SPREAD, strict=True)
        )
        self._known = _Known(shift, turn, turns, hidden)
        if begun is not None:
            # The former rotation is a prior for an uncertain one.
            self._known.presume(change_between(seen, begun.was)[3:], begun, self._settings.nis_gate)
            self._settle(self._known)
        self._jumps.clear()

    def _follow(self, known: "_Known", estimate: TargetEstimate, elapsed: float) -> None:
        """Advance to the time of an estimate, and correct by it."""
        noises, hidden = self._noise(estimate)
        known.shift.advance(elapsed, noises[0])
        known.turn.advance(elapsed, noises[1])
        self._settle(known)
        turns = UnobservableTurns.of(estimate)
        change = change_between(
            self._pose, turns.with_expected(self._pose, estimate.world_from_object)
        )
        odd = known.correct(change, noises, turns, self._settings.nis_gate)
        known.turn.inflate(_OPEN_WANDER * _OPEN_WANDER * elapsed * turns.spread)
        self._settle(known)
        self._known = replace(known, turns=turns, hidden=hidden)
        self._time_s, self._odd, self._turn_off = estimate.time_s, odd, change[3:]

    def _settle(self, known: "_Known") -> None:
        moved = np.concatenate([known.shift.settle(), known.turn.settle()])
        self._pose = shifted_and_turned(self._pose, moved)

    def _noise(self, estimate: TargetEstimate) -> tuple[tuple[Noise, Noise], Floats]:
        """Return the noise of translation and rotation of an estimate, and their hidden covariance.

        The latter, (2, 3, 3), is not filtered, but is added to the reported covariance.
        """
        settings = self._settings
        floors = np.square([settings.linear_noise, settings.angular_noise])
        reported, doubt = np.zeros((2, 3, 3)), 0.0
        if settings.use_covariance:
            world = estimate.world_from_object.matrix()[:3, :3]
            whole = estimate.covariance
            parts = whole[:3, :3], whole[3:, 3:]
            reported = np.array([exact.product(world, part, world.T) for part in parts])
            doubt = _doubt(estimate)
        wrong = settings.wrong_turn * float(np.sqrt(doubt))
        # The more certain the tracker is, the faster its earlier errors decay.
        fading_s = max(_SOONEST_S, settings.fading_s * doubt / (doubt + _HARDLY))
        fresh = settings.fresh * reported
        # The tracker's noise includes drift, but successive positions differ less.
        fresh[0] *= min(1.0, _FRESHEST * _FRESHEST / max(float(fresh[0].trace()), _TINY))
        news = fresh + floors[:, None, None] * np.eye(3)
        noises = Noise(news[0], 0.0, fading_s), Noise(news[1], wrong, fading_s)
        return noises, reported - fresh


@dataclass(frozen=True, eq=False)
class _Begun:
    """A restart: its time, its probability of error, and the state and pose before it."""

    time_s: float
    doubt: float
    before: "_Known"
    was: Pose

    def is_outdone(self, estimate: TargetEstimate) -> bool:
        """Return whether a soon following estimate is much more certain, so that it restarts."""
        soon = estimate.time_s - self.time_s < _SOONEST_S
        return soon and max(_LEAST_DOUBT, _doubt(estimate)) < _SURER * self.doubt


@dataclass(frozen=True, eq=False)
class _Known:
    """The state of an object's motion.

    `turns` are the unobservable rotations of the newest estimate, `hidden` (2, 3, 3) the additional
    covariance of its translation and rotation.
    """

    shift: Motion
    turn: Motion
    turns: UnobservableTurns
    hidden: Floats

    def ahead(self, span: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Predict translation and rotation (6,) from the reference, and their two derivatives.

        The covariances (6, 6) of translation and rotation and of their rates follow, without
        unobservable rotations.
        """
        return predicted_motion((self.shift, self.turn), self.hidden, self.turns.spread, span)

    def presume(self, turn: Floats, begun: "_Begun", nis_gate: float) -> None:
        """Apply the rotation before the restart, at `turn` (3,) from the present one, as a prior.

        The more certain the tracker is of the new rotation, the less weight the prior has.
        """
        across = self.turns.observable.T
        if not len(across):
            return
        unseen = _TURNED * _TURNED / begun.doubt * np.eye(3)
        spread = begun.before.turn.ahead(0.0)[1][:3, :3] + unseen
        supposed = Measurement.of_place(across, spread)
        self.turn.correct(supposed, exact.product(across, turn), nis_gate)

    def correct(
        self, change: Floats, noises: tuple[Noise, Noise], turns: UnobservableTurns, nis_gate: float
    ) -> bool:
        """Correct by a measured translation and rotation (6,); return whether it is an outlier."""
        place = Measurement.along(np.eye(3), noises[0])
        nis = self.shift.correct(place, change[:3], nis_gate)
        # About unobservable axes the object is assumed to be at rest: otherwise their uncertainty
        # would grow without bound, and the first observed rotation would cause a large correction.
        seen, axes = turns.observable.T, turns.axes.T
        turned = Measurement.along(seen, noises[1]).and_resting(axes, _OPEN_SPEED)
        innovation = np.concatenate([exact.product(seen, change[3:]), np.zeros(len(axes))])
        return max(nis, self.turn.correct(turned, innovation, nis_gate)) > nis_gate


def _doubt(estimate: TargetEstimate) -> float:
    """Return the probability that an estimate is wrong, 0 to 1."""
    return 1.0 - min(max(estimate.confidence, 0.0), 1.0)


def _priors(settings: TargetSettings) -> tuple[MotionPrior, MotionPrior]:
    """Return the expected translation and rotation of an object."""
    lasting = settings.change_s, settings.fading_s
    singer, oscillation = MotionModel.singer, MotionModel.oscillation
    shifts = [
        singer(settings.linear_jerk, settings.going_s),
        singer(settings.gliding_jerk, settings.gliding_s),
    ]
    if settings.period_s:
        shifts.append(oscillation(settings.swinging_jerk, settings.period_s))
    turns = [
        singer(settings.angular_jerk, settings.turning_s),
        singer(settings.rolling_jerk, settings.gliding_s),
    ]
    return (
        MotionPrior(settings.linear_rest, shifts, *lasting),
        MotionPrior(settings.angular_rest, turns, *lasting),
    )

"""The motion of the tracked object: filters estimates, and predicts where it is by now."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Pose, exact
from servoid.servo.arm import Floats
from servoid.servo.belief.jumps import GateResult, Jumps
from servoid.servo.belief.motion import Going, Manner, Motion, Noise, Seen, Swinging
from servoid.servo.belief.unobservable_turns import UnobservableTurns, UnsureEstimate
from servoid.servo.law.moving import change_between, cross_matrix, shifted_and_turned
from servoid.servo.settings import TargetSettings

# What an object may do when it is first seen: m/s and m/s², rad/s and rad/s².
_START_SPREAD = ((0.3, 0.2), (1.0, 1.0))
_HARDLY = 0.05  # doubt of which little is left when it is no more
_SOONEST_S = 0.5  # in which what was doubted is put right when nothing is
_FRESHEST = 0.003  # m: standard deviation of what is new in a place, at most
_TINY = 1e-12  # m²
_OPEN_SPEED = 0.05  # rad/s: turning that images do not tell is about none
_OPEN_WANDER = 0.1  # rad per root s: how an open turn becomes unknown
_TURNED = 0.2  # rad: standard deviation, about any axis, of a turn that nobody saw nor sees now
_LEAST_DOUBT = 1e-3
_SURER = 0.5  # share of the doubt of an estimate, with less of which another is much surer


class TargetEstimate(UnsureEstimate, Protocol):
    """What servoing needs of a tracker's estimate."""

    @property
    def time_s(self) -> float:
        """Return when the images were taken."""
        ...

    @property
    def confidence(self) -> float:
        """Return the share of what should be seen that was, 0 to 1."""
        ...

    @property
    def status(self) -> str:
        """Return `tracking`, `searching` or `lost`."""
        ...

    @property
    def located(self) -> bool:
        """Return whether the images confirm where the object is, though maybe not its turn."""
        ...


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where the object is at a time; `twist` and `acceleration` are (6,), in the world.

    They are those of the object's origin, linear, and of the object, angular. `covariance` (6, 6)
    is of a shift and a turn in the world, about axes whose turn is open 0, and `twist_covariance`
    (6, 6) of the twist.
    """

    time_s: float
    world_from_object: Pose
    twist: Floats
    acceleration: Floats
    covariance: Floats
    twist_covariance: Floats

    @property
    def place(self) -> Floats:
        """Return where the object's origin is in the world, (3,)."""
        return np.array(self.world_from_object.translation)

    @classmethod
    def at_rest(cls, time_s: float, world_from_object: Pose) -> "Prediction":
        """Make one of an object that is known to stand still."""
        still, sure = np.zeros(6), np.zeros((6, 6))
        return cls(time_s, world_from_object, still, still, sure, sure)

    def sure_shares(self, linear: float, angular: float) -> Floats:
        """Return shares (6,) of the twist, less than 1 beyond standard deviations of its halves."""
        variances = self.twist_covariance.diagonal().reshape(2, 3).sum(axis=1)
        sure = np.square([linear, angular])
        return np.repeat(np.sqrt(sure / np.maximum(sure, variances)), 3)

    def spread_at(self, point: Floats) -> float:
        """Return the standard deviation, in m, of a place (3,) in the world, tied to the object."""
        arm = cross_matrix(point - self.place)
        carried = np.concatenate([np.eye(3), -arm], axis=1)
        return float(np.sqrt(exact.product(carried, self.covariance, carried.T).trace()))


class TargetFilter:
    """Says where an object is and how it moves, from estimates whose errors last for a while.

    Shift and turn, in the world, the turn about the object's origin, have a `Motion` each. An
    estimate that is farther off than its noise explains has the less weight; one that the object
    cannot have reached is for `Jumps` to judge.
    """

    def __init__(self, settings: TargetSettings) -> None:
        self._settings = settings
        self._manners = _manners(settings)
        self._jumps = Jumps(settings)
        self._time_s: float | None = None
        self._pose = Pose.identity()
        self._known: _Known | None = None
        self._odd = False
        self._turn_off: Floats | None = None
        self._begun: _Begun | None = None

    @property
    def time_s(self) -> float | None:
        """Return when the last used estimate was, None before the first."""
        return self._time_s

    @property
    def jumps(self) -> int:
        """Return how many estimates came since the last that the object could have reached."""
        return self._jumps.count

    @property
    def is_odd(self) -> bool:
        """Say if the last used estimate was farther off than it and what was believed explain."""
        return self._odd

    @property
    def turn_off(self) -> Floats | None:
        """Return by what turn (3,) in the world the last used estimate was off what was believed.

        Turns about open axes are left out. It is None of an estimate that nothing was believed
        before.
        """
        return self._turn_off

    def update(self, estimate: TargetEstimate) -> GateResult:
        """Take in an estimate, in the order of their times."""
        known = self._known
        if self._time_s is None or known is None:
            self._start(estimate)
            return GateResult.USED
        elapsed = estimate.time_s - self._time_s
        if elapsed <= 0.0:
            return GateResult.OUTDATED
        expected = self._after(known, min(elapsed, self._settings.horizon_s))
        seen = UnobservableTurns.of(estimate).left_out(expected, estimate.world_from_object)
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
        """Return where the object is at a time; no farther ahead than `horizon_s` it stands still.

        Where delays are not compensated, it is where the last images showed it.

        Raises:
            ServoError: there was no estimate yet.

        """
        if self._time_s is None or self._known is None:
            raise ServoError("no estimate has come yet; call update before predict")
        ahead, horizon = time_s - self._time_s, self._settings.horizon_s
        span = min(max(ahead, 0.0), horizon) if self._settings.compensate else 0.0
        states, covariances = self._known.ahead(span)
        twist, acceleration = states[:, 3:6].reshape(6), states[:, 6:9].reshape(6)
        rests = ahead > horizon
        return Prediction(
            time_s,
            shifted_and_turned(self._pose, states[:, :3].reshape(6)),
            np.zeros(6) if rests else twist,
            np.zeros(6) if rests else acceleration,
            self._known.told(covariances[:, :3, :3] + self._known.hidden),
            self._known.told(covariances[:, 3:6, 3:6]),
        )

    def forget(self) -> None:
        """Drop where the object is and how it moves, so that the next estimate starts anew.

        How it was turned is kept: about axes about which images do not tell its turn as it was,
        else as what it may have turned from meanwhile.
        """
        self._time_s = None
        self._jumps.clear()

    def _after(self, known: "_Known", elapsed: float) -> Pose:
        """Return where the object is so long after the last used estimate."""
        return shifted_and_turned(self._pose, known.ahead(elapsed)[0][:, :3].reshape(6))

    def _start(self, estimate: TargetEstimate, begun: "_Begun | None" = None) -> None:
        """Begin with an estimate; one that follows another beginning takes its place."""
        seen, turns = estimate.world_from_object, UnobservableTurns.of(estimate)
        if begun is None and self._known is not None:
            begun = _Begun(estimate.time_s, 1.0, self._known, self._pose)
        doubt = max(_LEAST_DOUBT, _doubt(estimate))
        self._begun = begun = None if begun is None else replace(begun, doubt=doubt)
        if begun is not None:
            # Else the hand would go around a plain bottle that is found again with another spin.
            seen = turns.left_out(begun.was, seen)
        self._time_s, self._pose, self._odd = estimate.time_s, seen, False
        self._turn_off = None
        noises, hidden = self._noise(estimate)
        shift, turn = (
            Motion(*begin) for begin in zip(self._manners, noises, _START_SPREAD, strict=True)
        )
        self._known = _Known(shift, turn, turns, hidden)
        if begun is not None:
            # Of a turn that is told badly, what it was before says more.
            self._known.presume(change_between(seen, begun.was)[3:], begun, self._settings.nis_gate)
            self._settle(self._known)
        self._jumps.clear()

    def _follow(self, known: "_Known", estimate: TargetEstimate, elapsed: float) -> None:
        """Go on to an estimate, and move towards it by what either is worth."""
        noises, hidden = self._noise(estimate)
        known.shift.advance(elapsed, noises[0])
        known.turn.advance(elapsed, noises[1])
        self._settle(known)
        turns = UnobservableTurns.of(estimate)
        change = change_between(self._pose, turns.left_out(self._pose, estimate.world_from_object))
        odd = known.correct(change, noises, turns, self._settings.nis_gate)
        known.turn.loosen(_OPEN_WANDER * _OPEN_WANDER * elapsed * turns.spread)
        self._settle(known)
        self._known = replace(known, turns=turns, hidden=hidden)
        self._time_s, self._odd, self._turn_off = estimate.time_s, odd, change[3:]

    def _settle(self, known: "_Known") -> None:
        moved = np.concatenate([known.shift.settle(), known.turn.settle()])
        self._pose = shifted_and_turned(self._pose, moved)

    def _noise(self, estimate: TargetEstimate) -> tuple[tuple[Noise, Noise], Floats]:
        """Return how far shift and turn of an estimate may be off, and what does not show of it.

        The last, (2, 3, 3), fades too fast to lead the hand astray, and counts as unknown.
        """
        settings = self._settings
        floors = np.square([settings.linear_noise, settings.angular_noise])
        told, doubt = np.zeros((2, 3, 3)), 0.0
        if settings.use_covariance:
            world = estimate.world_from_object.matrix()[:3, :3]
            whole = estimate.covariance
            parts = whole[:3, :3], whole[3:, 3:]
            told = np.array([exact.product(world, part, world.T) for part in parts])
            doubt = _doubt(estimate)
        wrong = settings.wrong_turn * float(np.sqrt(doubt))
        # The surer the tracker is, the sooner that is over which it had wrong before.
        fading_s = max(_SOONEST_S, settings.fading_s * doubt / (doubt + _HARDLY))
        fresh = settings.fresh * told
        # What drifts is told as noise, too, but places of successive images are not so far apart.
        fresh[0] *= min(1.0, _FRESHEST * _FRESHEST / max(float(fresh[0].trace()), _TINY))
        news = fresh + floors[:, None, None] * np.eye(3)
        noises = Noise(news[0], 0.0, fading_s), Noise(news[1], wrong, fading_s)
        return noises, told - fresh


@dataclass(frozen=True, eq=False)
class _Begun:
    """When what is known began anew, how doubtful that was, what was known before, and where."""

    time_s: float
    doubt: float
    before: "_Known"
    was: Pose

    def is_outdone(self, estimate: TargetEstimate) -> bool:
        """Say if an estimate that comes soon after is so much surer that it should have begun."""
        soon = estimate.time_s - self.time_s < _SOONEST_S
        return soon and max(_LEAST_DOUBT, _doubt(estimate)) < _SURER * self.doubt


@dataclass(frozen=True, eq=False)
class _Known:
    """What is known of an object's motion.

    `turns` are the open ones of the newest estimate, `hidden` (2, 3, 3) what its shift and turn may
    have wrong besides.
    """

    shift: Motion
    turn: Motion
    turns: UnobservableTurns
    hidden: Floats

    def ahead(self, span: float) -> tuple[Floats, Floats]:
        """Return the states (2, 12) of shift and turn, and covariances, so long after it."""
        both = (self.shift.ahead(span), self.turn.ahead(span))
        return np.array([state for state, _ in both]), np.array([spread for _, spread in both])

    def told(self, covariances: Floats) -> Floats:
        """Join covariances of shift and turn, (2, 3, 3), without the open turns, to (6, 6)."""
        across = np.eye(3) - self.turns.spread
        whole = np.zeros((6, 6))
        whole[:3, :3] = covariances[0]
        whole[3:, 3:] = exact.product(across, covariances[1], across)
        return whole

    def presume(self, turn: Floats, begun: "_Begun", nis_gate: float) -> None:
        """Suppose that it is still turned as it was: by (3,), known as well as before.

        The less the tracker doubts that it was turned meanwhile, the less that says.
        """
        across = self.turns.observable.T
        if not len(across):
            return
        unseen = _TURNED * _TURNED / begun.doubt * np.eye(3)
        spread = begun.before.turn.ahead(0.0)[1][:3, :3] + unseen
        supposed = Seen.of_place(across, spread)
        self.turn.correct(supposed, exact.product(across, turn), nis_gate)

    def correct(
        self, change: Floats, noises: tuple[Noise, Noise], turns: UnobservableTurns, nis_gate: float
    ) -> bool:
        """Take in what was seen, shifted and turned by (6,); say if it is an outlier."""
        place = Seen.along(np.eye(3), noises[0])
        nis = self.shift.correct(place, change[:3], nis_gate)
        # About open axes the object is supposed to rest; if nothing said so, the first turn that is
        # told would throw it about, for by then it might be turned and turning in any way.
        seen, axes = turns.observable.T, turns.axes.T
        turned = Seen.along(seen, noises[1]).and_resting(axes, _OPEN_SPEED)
        innovation = np.concatenate([exact.product(seen, change[3:]), np.zeros(len(axes))])
        return max(nis, self.turn.correct(turned, innovation, nis_gate)) > nis_gate


def _doubt(estimate: TargetEstimate) -> float:
    """Return how likely an estimate is wrong, 0 to 1."""
    return 1.0 - min(max(estimate.confidence, 0.0), 1.0)


def _manners(settings: TargetSettings) -> tuple[Manner, Manner]:
    """Return how an object shifts, and how it turns."""
    lasting = settings.change_s, settings.fading_s
    swings = (Swinging(settings.swinging_jerk, settings.period_s),) if settings.period_s else ()
    shifts = (
        Going(settings.linear_jerk, settings.going_s),
        Going(settings.gliding_jerk, settings.gliding_s),
        *swings,
    )
    turns = (
        Going(settings.angular_jerk, settings.turning_s),
        Going(settings.rolling_jerk, settings.gliding_s),
    )
    return (
        Manner(settings.linear_rest, shifts, *lasting),
        Manner(settings.angular_rest, turns, *lasting),
    )

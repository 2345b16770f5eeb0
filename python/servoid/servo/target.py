"""The motion of the tracked object: filters estimates, and predicts where it is by now."""

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Pose, exact
from servoid.servo.arm import Floats
from servoid.servo.moving import change_between, shifted_and_turned
from servoid.servo.open_turns import OpenTurns, UnsureEstimate
from servoid.servo.settings import TargetSettings

_START_SPEED = (0.3, 1.0)  # m/s and rad/s: what an object may do when it is first seen
_START_ACCELERATION = (0.2, 1.0)
_OPEN_SPEED = 0.05  # rad/s: turning that images do not tell is about none


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


class Verdict(Enum):
    """What became of an estimate."""

    USED = "used"
    OUTDATED = "outdated"
    TELEPORT = "teleport"
    RESTARTED = "restarted"


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where the object is at a time; `twist` and `acceleration` are (6,), in the world.

    They are those of the object's origin, linear, and of the object, angular.
    """

    time_s: float
    world_from_object: Pose
    twist: Floats
    acceleration: Floats

    @property
    def place(self) -> Floats:
        """Return where the object's origin is in the world, (3,)."""
        return np.array(self.world_from_object.translation)


class TargetFilter:
    """A Kalman filter of pose, twist and acceleration of an object in the world.

    Its error state is (shift, turn) in the world, the turn about the object's origin. An estimate
    that is farther off than its noise explains has the less weight; one that the object cannot have
    reached is left out, unless several in a row agree.
    """

    def __init__(self, settings: TargetSettings) -> None:
        self._settings = settings
        self._floor = np.square(np.repeat([settings.linear_noise, settings.angular_noise], 3))
        self._drive = np.square(np.repeat([settings.linear_jerk, settings.angular_jerk], 3))
        self._time_s: float | None = None
        self._pose = Pose.identity()
        self._met = False
        self._motion = np.zeros((2, 6))  # twist and acceleration
        self._covariance = np.zeros((18, 18))
        self._strangers: list[TargetEstimate] = []

    @property
    def time_s(self) -> float | None:
        """Return when the last used estimate was, None before the first."""
        return self._time_s

    def update(self, estimate: TargetEstimate) -> Verdict:
        """Take in an estimate, in the order of their times."""
        if self._time_s is None:
            self._start(estimate)
            return Verdict.USED
        elapsed = estimate.time_s - self._time_s
        if elapsed <= 0.0:
            return Verdict.OUTDATED
        expected = self._after(min(elapsed, self._settings.horizon_s))
        turns = OpenTurns.of(estimate, self._settings.open_turn)
        seen = turns.left_out(expected, estimate.world_from_object)
        if not self._can_reach(expected, seen, elapsed):
            return self._meet(estimate)
        self._strangers.clear()
        self._advance(elapsed)
        self._correct(seen, self._noise(estimate), turns)
        self._time_s = estimate.time_s
        return Verdict.USED

    def predict(self, time_s: float) -> Prediction:
        """Return where the object is at a time; no farther ahead than `horizon_s` it stands still.

        Where delays are not compensated, it is where the last images showed it.

        Raises:
            ServoError: there was no estimate yet.

        """
        if self._time_s is None:
            raise ServoError("no estimate has come yet; call update before predict")
        ahead = time_s - self._time_s
        horizon = self._settings.horizon_s
        span = min(ahead, horizon) if self._settings.compensate else 0.0
        pose = self._after(span)
        if ahead > horizon:
            return Prediction(time_s, pose, np.zeros(6), np.zeros(6))
        twist, acceleration = self._motion
        return Prediction(time_s, pose, twist + span * acceleration, acceleration.copy())

    def forget(self) -> None:
        """Drop where the object is and how it moves, so that the next estimate starts anew.

        How it was turned about axes about which images do not tell its turn is kept.
        """
        self._time_s = None
        self._strangers.clear()

    def _after(self, elapsed: float) -> Pose:
        """Return where the object is so long after the last used estimate."""
        twist, acceleration = self._motion
        return shifted_and_turned(self._pose, elapsed * (twist + 0.5 * elapsed * acceleration))

    def _start(self, estimate: TargetEstimate) -> None:
        seen = estimate.world_from_object
        if self._met:
            # Else the hand would go around a plain bottle that is found again with another spin.
            seen = OpenTurns.of(estimate, self._settings.open_turn).left_out(self._pose, seen)
        self._time_s, self._pose, self._met = estimate.time_s, seen, True
        self._motion = np.zeros((2, 6))
        self._covariance = np.zeros((18, 18))
        self._covariance[:6, :6] = self._noise(estimate)
        self._covariance[6:12, 6:12] = np.diag(np.square(np.repeat(_START_SPEED, 3)))
        self._covariance[12:, 12:] = np.diag(np.square(np.repeat(_START_ACCELERATION, 3)))
        self._strangers.clear()

    def _can_reach(self, expected: Pose, seen: Pose, elapsed: float) -> bool:
        settings = self._settings
        change = change_between(expected, seen)
        shift, turn = exact.norm(change[:3]), exact.norm(change[3:])
        return (
            shift <= settings.linear_jump + settings.linear_speed * elapsed
            and turn <= settings.angular_jump + settings.angular_speed * elapsed
        )

    def _meet(self, estimate: TargetEstimate) -> Verdict:
        """Keep an estimate that cannot be; start anew where several in a row agree."""
        if self._strangers:
            last = self._strangers[-1]
            elapsed = estimate.time_s - last.time_s
            if elapsed <= 0.0:
                return Verdict.OUTDATED
            if not self._can_reach(last.world_from_object, estimate.world_from_object, elapsed):
                self._strangers.clear()
        self._strangers.append(estimate)
        if len(self._strangers) < self._settings.agreeing:
            return Verdict.TELEPORT
        self._start(estimate)
        return Verdict.RESTARTED

    def _advance(self, elapsed: float) -> None:
        """Move the state and its covariance ahead in time."""
        self._pose = self._after(elapsed)
        self._motion[0] += elapsed * self._motion[1]
        half = 0.5 * elapsed * elapsed
        step = np.eye(18) + elapsed * np.eye(18, k=6) + half * np.eye(18, k=12)
        spread = _white_jerk(elapsed)
        moved = exact.product(step, self._covariance, step.T)
        self._covariance = moved + np.kron(spread, np.diag(self._drive))

    def _correct(self, seen: Pose, noise: Floats, turns: OpenTurns) -> None:
        """Move the state towards a seen pose, by what either is worth."""
        change = change_between(self._pose, seen)
        told, count = 3 + turns.told.shape[1], turns.axes.shape[1]
        # About open axes the object is supposed to rest; if nothing said so, the first turn that is
        # told would throw it about, for by then it might be turned and turning in any way.
        look = np.zeros((6 + count, 18))
        look[:3, :3], look[3:told, 3:6], look[told:6, 3:6] = np.eye(3), turns.told.T, turns.axes.T
        look[6:, 9:12] = turns.axes.T
        turning = exact.product(turns.axes.T, self._motion[0, 3:])
        surprise = np.concatenate([exact.product(look[:6, :6], change), -turning])
        spread = np.zeros((6 + count, 6 + count))
        spread[:told, :told] = exact.product(look[:told, :6], noise, look[:told, :6].T)
        spread[told:6, told:6] = np.square(self._settings.open_turn) * np.eye(count)
        spread[6:, 6:] = np.square(_OPEN_SPEED) * np.eye(count)
        shared = exact.product(look, self._covariance)
        known = exact.product(shared, look.T)
        oddness = exact.dot(surprise, exact.solve(known + spread, surprise))
        gain = exact.solve(known + spread * max(1.0, oddness / self._settings.oddness), shared).T
        self._move(exact.product(gain, surprise))
        left = self._covariance - exact.product(gain, shared)
        self._covariance = 0.5 * (left + left.T)

    def _move(self, change: Floats) -> None:
        """Add a change (18,) to pose, twist and acceleration."""
        self._pose = shifted_and_turned(self._pose, change[:6])
        self._motion += change[6:].reshape(2, 6)

    def _noise(self, estimate: TargetEstimate) -> Floats:
        """Return (6, 6): the covariance of an estimate in the world, no less than the floor."""
        noise = np.diag(self._floor)
        if self._settings.use_covariance:
            turn = np.zeros((6, 6))
            turn[:3, :3] = turn[3:, 3:] = estimate.world_from_object.matrix()[:3, :3]
            noise += exact.product(turn, estimate.covariance, turn.T)
        return noise


def _white_jerk(elapsed: float) -> Floats:
    """Return (3, 3): covariance of position, speed and acceleration by a white jerk of one."""
    powers = np.cumprod(np.full(5, elapsed))
    return np.array(
        [
            [powers[4] / 20.0, powers[3] / 8.0, powers[2] / 6.0],
            [powers[3] / 8.0, powers[2] / 3.0, powers[1] / 2.0],
            [powers[2] / 6.0, powers[1] / 2.0, powers[0]],
        ]
    )

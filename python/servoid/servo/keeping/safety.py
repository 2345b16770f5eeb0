"""Decides when a target estimate may be trusted, and reports why the arm is held."""

from enum import Enum

import numpy as np

from servoid.config import WORLD_M
from servoid.pose import Pose, exact
from servoid.servo.belief.jumps import GateResult
from servoid.servo.belief.target import Prediction, TargetEstimate, TargetFilter
from servoid.servo.belief.unobservable_turns import unobservable_shifts
from servoid.servo.belief.watchdog import Drifting, Parting, Straying, Watchdog
from servoid.servo.settings import SafetySettings
from servoid.source import Instant


class Reason(Enum):
    """Why the arm is held or limited; the value is a message for the user."""

    NO_TARGET = "no target has been seen yet"
    NO_IMAGES = "no image came for too long"
    UNANSWERED = "the tracker has not answered for too long"
    FROZEN = "a camera moves but its image does not change"
    SEARCHING = "the tracker searches for the target"
    LOST = "the target is lost"
    UNSURE = "the tracker's confidence is too low"
    AHEAD = "image time stamps lie in the future"
    NOT_FINITE = "the estimate or the goal holds numbers that are not finite, or not plausible in m"
    TELEPORT = "the target jumped farther than it can move"
    RETURNING = "the target is back; waiting for more images that confirm it"
    BAD_STATE = "the arm's joint state, Jacobian or distances are not finite, or cannot be true"
    STALE = "the time stamp of the arm's joint state has not advanced for too long"
    DISOBEYED = "the arm's joints did not move as commanded; Controller.resume lets them move again"
    PROTECTIVE_STOP = "the arm's own driver has stopped it and waits for a reset"
    PARTED = "the tracker's estimates have differed from the filtered pose for too long"
    ADRIFT = "uncertain estimates of the target's rotation would move the goal too far"
    STRAYED = "following an uncertain estimate of the target's rotation moved the goal too far"
    ROUGH = "the target's pose is too uncertain for an accurate goal"
    UNSEEN = "the target is not visible now; its motion is extrapolated"
    AWAY = "the hand is on its way to its goal"
    WORKSPACE = "the hand is at the edge of its workspace"
    NEAR = "the hand is at its minimum distance from the object"
    COLLISION = "parts of the arm are at their minimum distance from each other or the room"
    LATE = "commands come less often than the arm's period"
    LAGGING = "the joints follow their commands later than joints.reaction_s, and brake earlier"
    UNREACHABLE = "the arm does not reach the goal"
    SINGULAR = "the arm is in a singular pose and cannot move towards the goal"
    HAND_SPEED = "the hand is at its speed limit"
    HAND_ACCELERATION = "the hand is at its acceleration limit"
    JOINT_SPEED = "a joint is at its speed limit"
    JOINT_ACCELERATION = "a joint is at its acceleration limit"
    JOINT_JERK = "a joint is at its jerk limit"
    JOINT_LIMIT = "a joint is near its position limit"


# Limits that any quick motion reaches, and braking early: neither keeps the hand from its goal.
ORDINARY = frozenset(
    {
        Reason.HAND_SPEED,
        Reason.HAND_ACCELERATION,
        Reason.JOINT_SPEED,
        Reason.JOINT_ACCELERATION,
        Reason.JOINT_JERK,
        Reason.LAGGING,
    }
)
# Reasons to doubt the goal, which the hand follows nevertheless.
DOUBTING = frozenset({Reason.ROUGH, Reason.PARTED, Reason.UNSEEN})
# Reasons that hold the hand although the position of the target is known.
LOCATED = frozenset({Reason.PROTECTIVE_STOP, Reason.ADRIFT, Reason.STRAYED})
_TOLERATED_JUMPS = 1
_ROUGH_SHIFTS = 1  # unobservable translations of a position: the distance of a small plain ball


def is_within_reason(pose: Pose, most_m: float = WORLD_M) -> bool:
    """Return whether a pose is finite, and not absurdly far away."""
    matrix = pose.matrix()
    return bool(np.isfinite(matrix).all() and np.abs(matrix[:3, 3]).max() <= most_m)


class SafetySupervisor:
    """Decides from images and estimates whether the hand may follow the target.

    The filter's prediction bridges a short gap. After a longer one, after a jump of the target, or
    if estimates contradict the filter for long, the arm is held until several consecutive trusted
    estimates have arrived, which the filter averages meanwhile.
    """

    def __init__(self, settings: SafetySettings, target: TargetFilter) -> None:
        self._settings, self._target = settings, target
        self._watchdog = Watchdog(settings)
        self._fault = Reason.NO_TARGET
        self._in_a_row = self._sure_in_a_row = 0
        self._parting, self._drifting = Parting(settings), Drifting(settings)
        self._straying = Straying(settings)
        self._object_from_goal: Pose | None = None
        self._trusted_s: float | None = None
        self._last_estimate_s: float | None = None  # time of the filter's last estimate
        self._held, self._stopped = True, False
        self._resumed_s = 0.0
        self._now_s = np.inf

    def advance(self, time_s: float, *, stopped: bool = False) -> None:
        """Advance to a time of the arm's clock, which also stamps the observations.

        The arm is held after too long a gap, and during a protective stop; consecutive trusted
        estimates release it.
        """
        self._now_s, self._stopped = time_s, stopped
        last = self._trusted_s
        # After a jump of the clock, the knowledge of the target counts as old.
        if last is None or abs(time_s - last) > self._settings.coast_s:
            self._held = True
            self._in_a_row = 0
        elif stopped or self._astray or self._target.jumps > _TOLERATED_JUMPS:
            self._held = True
        elif self._held and self._in_a_row >= self._settings.resume_after:
            self._held, self._resumed_s = False, time_s

    def interrupt(self) -> None:
        """Hold the arm until the next `advance`; then it regains its speed as after other holds."""
        self._held = True

    def see(self, instant: Instant | None, estimate: TargetEstimate | None) -> None:
        """Process an observation and its estimate; the filter uses it if it can be trusted."""
        if instant is not None:
            self._watchdog.see(instant)
        elif estimate is not None:
            self._watchdog.hear_of_images(estimate.time_s)
        fault = self._fault_of(estimate)
        if fault is None and estimate is not None:
            self._follow(estimate)
        elif fault is not None:
            self._distrust(fault)

    def holding(self) -> frozenset[Reason]:
        """Return why the arm is held at present; empty if it may move."""
        if not self._held:
            return frozenset()
        kept = {
            Reason.PROTECTIVE_STOP: self._stopped,
            Reason.ADRIFT: self._drifting.holds,
            Reason.STRAYED: self._straying.holds,
        }
        reasons = {reason for reason, holds in kept.items() if holds}
        if self._in_a_row == 0:
            reasons.add(self._fault)
        elif self._in_a_row < self._settings.resume_after or not reasons:
            reasons.add(Reason.RETURNING)
        if self._trusted_s is None:
            reasons.add(Reason.NO_TARGET)
        if self._watchdog.is_stale(self._now_s):
            reasons.add(Reason.NO_IMAGES)
        return frozenset(reasons)

    def limiting(self, target: Prediction, goal: Pose, off: float) -> frozenset[Reason]:
        """Return why the hand of a moving arm is not, or may not be, at its goal.

        `off` is the estimated distance of the hand from its goal in the world, in m.
        """
        self._object_from_goal = target.world_from_object.inverse() @ goal
        self._drifting.reach(self._lever)
        reasons = {
            Reason.ROUGH: self._is_rough(target),
            Reason.PARTED: self._parting.is_reported,
            Reason.UNSEEN: self._in_a_row == 0,
            Reason.AWAY: off > self._settings.away,
        }
        return frozenset(reason for reason, holds in reasons.items() if holds)

    def speed_scale(self) -> float:
        """Return the allowed share of the hand's speed, which grows to 1 after a hold."""
        return min(1.0, max(0.0, (self._now_s - self._resumed_s) / self._settings.resume_s))

    @property
    def _astray(self) -> bool:
        """Return whether uncertain rotations hold the arm."""
        return self._drifting.holds or self._straying.holds

    @property
    def _lever(self) -> float:
        """Return the distance of the goal from the target's origin, in m; 0 without a goal."""
        goal = self._object_from_goal
        return 0.0 if goal is None else exact.norm(np.array(goal.translation))

    def _is_rough(self, target: Prediction) -> bool:
        """Return whether the goal's position relative to a target is uncertain."""
        if self._object_from_goal is None:
            return False
        goal = target.world_from_object @ self._object_from_goal
        return target.spread_at(np.array(goal.translation)) > self._settings.rough

    def _fault_of(self, estimate: TargetEstimate | None) -> Reason | None:
        """Return why an estimate must not be used, None if it may."""
        if self._watchdog.hangs:
            return Reason.FROZEN
        if estimate is None:
            return Reason.NO_IMAGES
        numbers = (estimate.time_s, estimate.confidence, estimate.covariance, estimate.unobservable)
        finite = all(np.all(np.isfinite(values)) for values in numbers)
        if not (finite and is_within_reason(estimate.world_from_object)):
            return Reason.NOT_FINITE
        if estimate.time_s > self._now_s + self._settings.coast_s:
            return Reason.AHEAD
        if not estimate.located:
            return Reason.LOST if estimate.status == "lost" else Reason.SEARCHING
        # If the rotation is unobservable, only the position is followed: `located` suffices.
        is_tracking = estimate.status == "tracking"
        trusted = estimate.confidence if is_tracking else 1.0
        if unobservable_shifts(estimate.unobservable) > (0 if is_tracking else _ROUGH_SHIFTS):
            trusted = 0.0
        return Reason.UNSURE if trusted < self._settings.least_confidence else None

    def _distrust(self, fault: Reason) -> None:
        self._fault, self._in_a_row = fault, 0

    def _follow(self, estimate: TargetEstimate) -> None:
        """Pass a credible estimate to the filter, and evaluate the result."""
        previous_s, self._last_estimate_s = self._last_estimate_s, estimate.time_s
        gap = previous_s is None or estimate.time_s - previous_s > self._settings.coast_s
        if self._held and self._in_a_row == 0 and (gap or self._target.jumps == 0):
            self._target.forget()  # motion before the gap does not predict motion after it
            self._parting.clear()
        is_sure = estimate.confidence >= self._settings.least_confidence
        self._sure_in_a_row = self._sure_in_a_row + 1 if is_sure else 0
        result = self._target.update(estimate)
        if result is GateResult.OUTDATED:
            return
        if result is GateResult.TELEPORT:
            self._distrust(Reason.TELEPORT)
            return
        if result is GateResult.RESTARTED:
            self._held, self._in_a_row = True, 0
        self._trusted_s = estimate.time_s
        if self._target.turn_off is not None:
            spread = float(np.sqrt(estimate.covariance[3:, 3:].trace()))
            off, led = self._target.turn_off, self._straying.led
            self._drifting.see(estimate.time_s, off, spread, led)
        self._parting.see(estimate.time_s, is_odd=self._target.is_odd)
        if self._parting.holds:
            self._held = True
            self._distrust(Reason.PARTED)
            return
        self._in_a_row += 1
        self._fault = Reason.NO_IMAGES  # if no further estimate arrives
        if self._in_a_row >= self._settings.resume_after:
            believed = self._target.predict(estimate.time_s)
            sure = self._sure_in_a_row >= self._settings.resume_after
            rough = not sure and self._is_rough(believed)
            pose = believed.world_from_object
            self._straying.see(estimate.time_s, pose, self._lever, is_rough=rough)

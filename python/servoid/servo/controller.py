"""Computes joint speeds from the target's estimate and the joints' state, once per period."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from servoid._native import Moving, change_between, twist_within
from servoid.config import FAR_M, NEAR_M, REACH_M
from servoid.pose import Floats, Pose, exact
from servoid.servo.arguments import check_arm, check_pose, check_state, checked_estimate
from servoid.servo.arm import Arm, JointState
from servoid.servo.belief.target import Prediction, TargetEstimate, TargetFilter
from servoid.servo.checked_arm import CheckedArm
from servoid.servo.keeping.arm_watch import ArmWatch
from servoid.servo.keeping.bounds import Rows
from servoid.servo.keeping.confirming import Confirming
from servoid.servo.keeping.now import LastCommand, Now
from servoid.servo.keeping.pace import Pace
from servoid.servo.keeping.paced_bounds import PacedBounds
from servoid.servo.keeping.safety import LOCATED, Reason, SafetySupervisor, is_within_reason
from servoid.servo.keeping.start_check import check_start
from servoid.servo.keeping.workspace_limits import walls_of
from servoid.servo.law.gaze import GazeControl
from servoid.servo.law.hand import correction, goal_error
from servoid.servo.law.ik import QuadraticJoints
from servoid.servo.law.joints import (
    HandJoints,
    HandSetpoint,
    JointSetpoint,
    PaperJoints,
    hand_weights,
)
from servoid.servo.law.reaching import Reaching
from servoid.servo.settings import JointLaw, JointSettings, ServoSettings
from servoid.source import Instant

_LAWS: dict[JointLaw, Callable[[Arm, JointSettings], HandJoints]] = {
    JointLaw.QP: QuadraticJoints,
    JointLaw.PAPER: PaperJoints,
}
_MISSED_PERIODS = 3  # after more periods without a command, the joints' measured speeds count


@dataclass(frozen=True, eq=False)
class Command:
    """The command of one control period, and the reasons for it.

    `velocities` (N,) are joint speeds in rad/s. `twist` (6,) is the corresponding hand velocity in
    the world, `hand_from_goal` the pose error, `world_from_object` the predicted present pose of
    the object, and `gaze` (3,) the desired angles of tilt, left and right pan. `holding` contains
    the reasons why the hand is held, `limiting` those that limit its motion. `late_s` is the
    measured lag of joints that are later than `joints.reaction_s` allows for, otherwise 0.
    """

    velocities: Floats
    twist: Floats
    hand_from_goal: Pose | None = None
    world_from_object: Pose | None = None
    gaze: Floats | None = None
    holding: frozenset[Reason] = frozenset()
    limiting: frozenset[Reason] = frozenset()
    late_s: float = 0.0


class Controller:
    """Controls the hand to a goal relative to the target, and the cameras to fixate it."""

    def __init__(self, arm: Arm, settings: ServoSettings | None = None) -> None:
        """Take an arm at rest; its present posture is the preferred one.

        Raises:
            ServoError: the arm lacks a member, or the settings are something else.
            MissingExtraError: the joint law needs a solver that is not installed.

        """
        check_arm(arm, settings)
        self._arm = arm = CheckedArm(arm)
        self._settings = settings = settings or ServoSettings()
        self._target = TargetFilter(settings.target)
        self._supervisor = SafetySupervisor(settings.safety, self._target)
        count, reaction_s = len(arm.joints.names), settings.joints.reaction_s
        self._watch = ArmWatch(settings.safety, arm.period_s, count, reaction_s)
        self._confirming = Confirming(arm.joints, arm.period_s)
        self._pace = Pace(arm.period_s)
        self._bounds = PacedBounds(arm, settings)
        self._reaching = Reaching(arm, settings.joints)
        self._law = _LAWS[settings.joints.law](arm, settings.joints)
        self._gaze = (
            None
            if arm.eyes is None
            else GazeControl(arm.eyes, arm.joints, settings.gaze, self._bounds.reaction_s)
        )
        self._hand = slice(0, arm.joints.hand_count)
        self._is_checked = False
        self._previous: LastCommand | None = None
        self._goal: tuple[float, Pose] | None = None
        self._sure: Prediction | None = None

    def see(self, instant: Instant | None, estimate: TargetEstimate | None) -> None:
        """Process a new observation and the tracker's estimate, None if it is unusable.

        Raises:
            ServoError: the estimate lacks a member, or one is of another kind or shape.

        """
        checked = None if estimate is None else checked_estimate(estimate)
        self._supervisor.see(instant, checked)

    def command(self, state: JointState, goal_from_object: Pose | None) -> Command:
        """Return the command that brings the object to its goal pose relative to the hand.

        Without a goal the hand rests and the cameras follow the target.

        Raises:
            ServoError: the state is not of the arm's joints, or the goal is no pose; at first also
                if the arm's Jacobian and poses contradict each other, or its hand is far outside
                of its workspace.

        """
        self._check_once(state)
        if goal_from_object is not None:
            check_pose("goal_from_object", goal_from_object)
        now = self._look_at(state)
        if now is None:
            return self._stop(state)
        holding = self._supervisor.holding() | self._pace.holding
        if self._target.time_s is None:
            return self._hold(now, None, holding)
        target = self._target.predict(state.time_s)
        speed_scale = self._supervisor.speed_scale()
        is_absurd = not _is_reachable(now, target.world_from_object.translation)
        if not (holding or is_absurd) and speed_scale == 1.0:
            self._sure = Prediction.at_rest(state.time_s, target.world_from_object)
        # A wrong estimate must not turn the cameras away from a hidden target.
        seen = target
        if is_absurd:
            seen = self._sure
        elif holding - LOCATED:
            seen = self._sure or target
        if goal_from_object is not None and not is_within_reason(goal_from_object, NEAR_M):
            is_absurd = True
        holding |= {Reason.NOT_FINITE} if is_absurd else frozenset()
        if holding or goal_from_object is None:
            self._goal = None
            return self._hold(now, seen, holding)
        goal = self._moving_goal(state.time_s, goal_from_object)
        # The joints lag behind their command.
        hand = self._settings.hand
        led = target.led(hand.lead_s, hand.sure_speed, hand.sure_turning)
        return self._pursue(now, led, goal, speed_scale)

    def go_to(self, state: JointState, world_from_goal: Pose, fixate: Floats) -> Command:
        """Return the command towards a hand pose in the world, with the cameras on a point (3,).

        Raises:
            ServoError: as for `command`.
            PoseError: the point is not of three finite numbers.

        """
        self._check_once(state)
        check_pose("world_from_goal", world_from_goal)
        now = self._look_at(state)
        if now is None:
            return self._stop(state)
        if state.stopped:
            return self._hold(now, None, frozenset({Reason.PROTECTIVE_STOP}))
        if self._pace.is_rare:
            return self._hold(now, None, self._pace.holding)
        point = Pose.from_parts(np.asarray(fixate).tolist(), [1.0, 0.0, 0.0, 0.0])
        places = point.translation, world_from_goal.translation
        if not all(_is_reachable(now, place) for place in places):
            return self._hold(now, None, frozenset({Reason.NOT_FINITE}))
        target = Prediction.at_rest(state.time_s, point)
        goal = Moving.at_rest(world_from_goal.inverse() @ point)
        return self._pursue(now, target, goal, 1.0)

    def resume(self) -> None:
        """Let a hand move again that is held as `DISOBEYED`, once the fault has been removed."""
        self._watch.resume()

    def rest(self, state: JointState | None) -> Command:
        """Return the command that brings hand and cameras to rest within their limits.

        If the state is unknown, None, the joints brake along the last command.
        """
        now = None if state is None else self._look_at(state)
        return self._stop(state) if now is None else self._hold(now, None, frozenset())

    def _check_once(self, state: JointState) -> None:
        """Check the arm at the first state that can be used."""
        if self._is_checked:
            return
        check_state(state, self._arm.joints)
        if not exact.is_finite(state.positions):
            return
        check_start(self._arm, np.asarray(state.positions, np.float64), self._settings.safety)
        self._is_checked = True

    def _pursue(
        self, now: Now, target: Prediction, goal_from_object: Moving, speed_scale: float
    ) -> Command:
        """Follow a goal relative to a target, as in Fig. 5 of the paper."""
        world_from_hand = Moving.from_twist(now.world_from_hand, now.twist)
        world_from_object = Moving.from_twist(target.world_from_object, target.twist)
        hand_from_goal = goal_error(world_from_hand, world_from_object, goal_from_object)
        world_from_goal = world_from_hand @ hand_from_goal
        walls = self._walls(now, target)
        if walls is None:
            return self._hold(now, target, frozenset({Reason.BAD_STATE}))
        wanted = self._hand_twist(now, hand_from_goal, world_from_goal, speed_scale)
        allowed = self._bounds.workspace.allowed(world_from_goal.pose, target.place)
        setpoint = self._law.setpoint(now.state, now.jacobian, HandSetpoint(wanted, allowed))
        window = now.window.part(self._hand)
        bounds = self._bounds.limiter.bounds(now.jacobian, now.last, window, walls, speed_scale)
        limited = self._bounds.limiter.nearest(setpoint, bounds)
        stuck = self._reaching.reasons(now.state, now.jacobian, wanted, allowed)
        off = exact.norm(np.array(hand_from_goal.pose.translation))
        untrue = self._supervisor.limiting(target, world_from_goal.pose, off)
        return self._sent(
            now,
            target,
            limited.velocities,
            hand_from_goal=hand_from_goal.pose,
            limiting=limited.reasons | stuck | untrue | self._pace.limiting | self._watch.limiting,
        )

    def _hand_twist(
        self, now: Now, hand_from_goal: Moving, world_from_goal: Moving, speed_scale: float
    ) -> Floats:
        """Return the hand velocity (6,) from the pose error and the goal's motion."""
        settings = self._settings.hand
        twist = correction(hand_from_goal, now.world_from_hand, settings)
        if settings.feed_forward:
            twist = twist + world_from_goal.twist
        return twist_within(twist, *self._bounds.limiter.speeds(speed_scale))

    def _walls(self, now: Now, target: Prediction) -> Rows | None:
        """Return the bounds of room, object and the arm's own parts; None if they are unknown."""
        room = self._bounds.workspace.velocity_limits(
            now.place, now.last[:3], target.place, target.twist[:3]
        )
        apart = self._bounds.workspace.apart(
            self._arm.solid, now.state.positions, now.previous, self._hand
        )
        return None if apart is None else walls_of(room, now.jacobian).and_also(apart)

    def _hold(self, now: Now, target: Prediction | None, holding: frozenset[Reason]) -> Command:
        """Brake the hand along its path; the cameras stay on the predicted target."""
        self._reaching.forget()
        twist = exact.product(now.jacobian, now.previous[self._hand])
        ticks = self._bounds.limiter.ticks_to_rest(twist)
        braked = self._bounds.joints.braked(now.previous, now.acceleration, ticks)[self._hand]
        weights = hand_weights(now.jacobian, self._settings.joints.angular_weight)
        setpoint = JointSetpoint(braked, weights)
        window, walls = now.window.part(self._hand), Rows.none(len(braked))
        bounds = self._bounds.limiter.bounds(now.jacobian, now.last, window, walls, 1.0)
        return self._sent(
            now, target, self._bounds.limiter.nearest(setpoint, bounds).velocities, holding=holding
        )

    def _sent(
        self,
        now: Now,
        target: Prediction | None,
        hand: Floats,
        *,
        hand_from_goal: Pose | None = None,
        holding: frozenset[Reason] = frozenset(),
        limiting: frozenset[Reason] = frozenset(),
    ) -> Command:
        """Add the cameras to the hand's joint speeds (n,), apply the limits, store the command."""
        velocities = now.window.bounded(self._bounds.joints.braked(now.previous, now.acceleration))
        velocities[self._hand] = hand
        twist = exact.product(now.jacobian, velocities[self._hand])
        angles = None
        if self._gaze is not None and target is not None:
            gaze = self._gaze.wanted(now.world_from_hand, twist, target.place, target.twist[:3])
            velocities[self._gaze.places] = self._gaze.velocities(
                now.state, gaze, now.window, self._pace.periods
            )
            angles = gaze.angles
        if not (exact.is_finite(velocities) and exact.is_finite(twist)):
            return self._stop(now.state, Reason.NOT_FINITE)
        self._previous = self._last_command(now, velocities, twist)
        place = None if target is None else target.world_from_object
        told = hand_from_goal, place, angles, holding, limiting, self._watch.late_s
        return Command(velocities.copy(), twist, *told)

    def _last_command(self, now: Now, velocities: Floats, twist: Floats) -> LastCommand:
        """Return the part of a command that the next one needs."""
        acceleration = (velocities - now.previous) / self._bounds.period_s
        return LastCommand(now.state.time_s, velocities, acceleration, twist, now.jacobian)

    def _stop(self, state: JointState | None, reason: Reason | None = None) -> Command:
        """Brake open-loop, if the state, or what was computed from it, cannot be used."""
        holding = frozenset({reason or self._watch.fault or Reason.BAD_STATE})
        last = self._previous
        if last is None:
            velocities, twist = np.zeros(len(self._arm.joints.names)), np.zeros(6)
        else:
            ticks = self._bounds.limiter.ticks_to_rest(last.twist)
            velocities = self._bounds.joints.blindly_braked(
                last.velocities, last.acceleration, ticks
            )
            acceleration = (velocities - last.velocities) / self._bounds.period_s
            twist = exact.product(last.jacobian, velocities[self._hand])
            time_s = last.time_s + self._arm.period_s if state is None else state.time_s
            self._previous = LastCommand(time_s, velocities, acceleration, twist, last.jacobian)
        return Command(velocities.copy(), twist, holding=holding)

    def _look_at(self, state: JointState) -> Now | None:
        """Compute the state of the hand; None if the joints' state cannot be used."""
        check_state(state, self._arm.joints)
        numbers = state.positions, state.velocities
        if not (isfinite(state.time_s) and all(map(exact.is_finite, numbers))):
            return None
        # What hits a stopped arm moves it at any speed.
        if not (state.stopped or self._bounds.joints.may_move_at(state.velocities)):
            return None
        self._supervisor.advance(state.time_s, stopped=state.stopped)
        self._pace.see(state.time_s)
        late_s = self._watch.late_s
        self._bounds = self._bounds.at(self._arm, self._settings, self._pace, late_s)
        velocities = np.asarray(state.velocities, np.float64)
        command = self._previous
        commanded = np.zeros(len(velocities)) if command is None else command.velocities
        if not self._watch.see(state, commanded):
            self._supervisor.interrupt()
            return None
        if (
            command is not None
            and state.time_s - command.time_s > _MISSED_PERIODS * self._bounds.period_s
        ):
            command = None
        if not (self._confirming.see(state, anew=command is None) or state.stopped):
            if command is None:
                self._previous = None  # joints that nobody commands are commanded to rest
            return None
        # Joints may be measured somewhat faster than they may be commanded.
        limits = self._bounds.joints
        previous = limits.clipped(velocities) if command is None else command.velocities
        # The command takes effect where the joints will be after their lag.
        ahead_s = self._settings.hand.lead_s + 0.5 * self._arm.period_s
        jacobian = self._arm.jacobian(state.positions + ahead_s * previous)[:, self._hand]
        present = self._arm.jacobian(state.positions)[:, self._hand]
        twist = exact.product(present, velocities[self._hand])
        # A hand that moves farther by a radian is that of an arm in millimetres.
        finite = exact.is_finite(jacobian) and exact.is_finite(twist)
        if not (finite and np.abs(jacobian[:3]).max() <= REACH_M):
            return None
        last = exact.product(jacobian, previous[self._hand]) if command is None else command.twist
        acceleration = np.zeros(len(previous)) if command is None else command.acceleration
        braking = self._bounds.limiter.braking(jacobian)
        return Now(
            state,
            self._arm.world_from_hand(state.positions),
            jacobian,
            twist,
            previous,
            acceleration,
            last,
            limits.window(state, previous, acceleration, braking),
        )

    def _moving_goal(self, time_s: float, goal_from_object: Pose) -> Moving:
        """Return the goal with its own motion, from the difference to the previous period."""
        last, self._goal = self._goal, (time_s, goal_from_object)
        if last is None or not 0.0 < time_s - last[0] < _MISSED_PERIODS * self._arm.period_s:
            return Moving.at_rest(goal_from_object)
        twist = change_between(last[1], goal_from_object) / (time_s - last[0])
        settings = self._settings.hand
        if not np.array_equal(
            twist_within(twist, settings.linear_speed, settings.angular_speed), twist
        ):
            return Moving.at_rest(goal_from_object)  # another goal, not one that moves
        return Moving.from_twist(goal_from_object, twist)


def _is_reachable(now: Now, place: Sequence[float]) -> bool:
    """Return whether a place in the world, (3,), is finite, and not absurdly far from the hand."""
    pairs = zip(place, now.world_from_hand.translation, strict=True)
    return all(abs(one - other) <= FAR_M for one, other in pairs)

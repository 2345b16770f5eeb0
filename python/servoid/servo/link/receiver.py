"""The driver's side of the protocol: decides which commands are valid, and drives the joints.

It uses no socket and no clock of its own, so that a driver in any language can reproduce it, and
tests can run it step by step.
"""

import secrets
from collections import Counter
from enum import Enum

import numpy as np

from servoid._native import stoppable_speed
from servoid.pose import Floats
from servoid.servo.arm import Joints, JointState
from servoid.servo.link.messages import FromLoop, MotionCommand, Phase, Start
from servoid.servo.link.settings import LinkSettings
from servoid.servo.link.stopping import StoppingTrajectory


class Refusal(Enum):
    """Why a message is refused; the value is a message for the user."""

    NO_MESSAGE = "the line is no message"
    NOT_STARTED = "the session was not started"
    OTHER_SESSION = "the session has ended, or belongs to another driver"
    MOVING = "the joints still move; start when they are at rest"
    OLD_NUMBER = "its number came before"
    OLD_STAMP = "it answers a state that is too old"
    EARLY_STAMP = "it answers a state of the future"
    NO_MOTION = "its motion is not valid"
    NO_TIME = "the joints' clock is not finite"
    STOPPED = "the arm is in a protective stop; reset it first"


class CommandReceiver:
    """Drives joints by the newest valid command, and brings them to rest without one.

    Commands are valid in a session only, which the loop starts by its name while the joints are at
    rest. The session ends when a command's motion ends without another command, or with the
    connection: the present motion is then completed, all else is refused, and the next session has
    another name. A restarted driver uses other names, too.
    """

    def __init__(self, joints: Joints, period_s: float, settings: LinkSettings) -> None:
        """Take joints at rest, which get speeds every `period_s` seconds."""
        self._joints, self._settings = joints, settings
        self._step = joints.acceleration * period_s
        self._reaction_s = 2.0 * period_s
        self._speeds = np.zeros(len(joints.names))
        self._motion: StoppingTrajectory | None = None
        self._begun_s = self._stamp_s = 0.0
        self._last_state_s = -np.inf
        self.refused: Counter[Refusal] = Counter()
        self.ended = ""
        self._open("")

    def _open(self, ended: str) -> None:
        """Wait for the start of a new session."""
        self.session: str = secrets.token_hex(8)
        self.phase: Phase = Phase.WAITING
        self.ended: str = ended
        self.accepted: int = 0
        self.missing: int = 0

    def end(self, why: str) -> None:
        """End the session; the present motion is completed."""
        if self.phase is Phase.RUNNING:
            self._open(why)

    def brake(self, why: str) -> None:
        """End the session, and brake the joints at once, as hard as their limits allow."""
        self._motion = None
        self.end(why)

    def take(self, message: FromLoop | None, state: JointState) -> Refusal | None:
        """Process a message, None if it is malformed; return why it is refused."""
        if isinstance(message, Start):
            refusal = self._start(message, state)
        elif isinstance(message, MotionCommand):
            refusal = self._command(message, state.time_s)
        else:
            refusal = Refusal.NO_MESSAGE
        if refusal is not None:
            self.refused[refusal] += 1
        return refusal

    def speeds(self, state: JointState) -> Floats:
        """Return the speeds (N,) for the next period, within all limits for any command."""
        wanted = np.zeros(len(self._speeds))
        positions = np.asarray(state.positions, np.float64)
        goes_on = state.time_s > self._last_state_s
        if state.time_s < self._last_state_s:
            self.brake("the arm's clock ran back")
        if state.stopped:
            self.brake("the arm is in a protective stop")
        if np.isfinite(state.time_s):
            self._last_state_s = state.time_s
        # With a stopped clock, no motion would end.
        usable = goes_on and np.isfinite([state.time_s, *positions]).all()
        if self._motion is not None and usable:
            wanted = self._motion.at(state.time_s - self._begun_s)
            if state.time_s - self._begun_s >= self._motion.end_s:
                self._motion = None
                self.end("no command came in time")
        self._speeds = self._bounded(wanted, positions)
        return self._speeds.copy()

    @property
    def is_at_rest(self) -> bool:
        """Return whether the commanded speeds are zero, and no motion is in progress."""
        moves = self._motion is not None and bool(self._motion.speeds.any())
        return not self._speeds.any() and not moves

    def _start(self, start: Start, state: JointState) -> Refusal | None:
        if start.session != self.session or self.phase is Phase.RUNNING:
            return Refusal.OTHER_SESSION
        if state.stopped:
            return Refusal.STOPPED
        if not self.is_at_rest:
            return Refusal.MOVING
        if not np.isfinite(state.time_s):
            return Refusal.NO_TIME
        self.phase, self.ended = Phase.RUNNING, ""
        self._stamp_s = self._begun_s = state.time_s
        self._motion = StoppingTrajectory.resting(len(self._speeds), self._settings.first_s)
        return None

    def _command(self, command: MotionCommand, now_s: float) -> Refusal | None:
        if command.session != self.session:
            return Refusal.OTHER_SESSION
        if self.phase is not Phase.RUNNING:
            return Refusal.NOT_STARTED
        if command.number <= self.accepted:
            return Refusal.OLD_NUMBER
        if not command.stamp_s <= now_s:
            return Refusal.EARLY_STAMP
        if command.stamp_s < self._stamp_s or now_s - command.stamp_s >= self._settings.hold_s:
            return Refusal.OLD_STAMP
        motion = _motion(command)
        if motion is None or motion.fault(self._joints, self._settings.hold_s) is not None:
            return Refusal.NO_MOTION
        self.missing += command.number - self.accepted - 1
        self.accepted, self._stamp_s = command.number, command.stamp_s
        self._motion, self._begun_s = motion, command.stamp_s
        return None

    def _bounded(self, wanted: Floats, positions: Floats) -> Floats:
        """Return the nearest speeds within the limits; those of acceleration rank last."""
        joints = self._joints
        room = np.array([positions - joints.lower, joints.upper - positions])
        room = np.where(np.isnan(room), 0.0, room)  # its position is unknown
        down, up = stoppable_speed(room, joints.acceleration, self._reaction_s)
        allowed = np.clip(wanted, np.maximum(-joints.speed, -down), np.minimum(joints.speed, up))
        return np.clip(allowed, self._speeds - self._step, self._speeds + self._step)


def _motion(command: MotionCommand) -> StoppingTrajectory | None:
    """Return the motion of a command, None if its rows differ in length."""
    if len({len(row) for row in command.speeds}) != 1:
        return None
    return StoppingTrajectory(
        np.array(command.times_s, np.float64), np.array(command.speeds, np.float64)
    )

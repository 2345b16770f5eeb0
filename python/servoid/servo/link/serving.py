"""Drives an arm in a process of its own, by the commands that arrive over a socket."""

import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.pose import Floats
from servoid.servo.arm import Joints, JointState
from servoid.servo.link.lines import Lines
from servoid.servo.link.messages import VERSION, Busy, Phase, State, Welcome, from_loop, line_of
from servoid.servo.link.receiver import CommandReceiver
from servoid.servo.link.settings import LinkSettings

_MOST = 64  # messages processed in a period; others stay queued


class DrivenJoints(Protocol):
    """The part of `Arm` that a driver needs."""

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    @property
    def period_s(self) -> float:
        """Return the duration of a command in seconds."""
        ...

    def state(self) -> JointState:
        """Return the present state of the joints."""
        ...

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return one period later."""
        ...


@dataclass(frozen=True, eq=False)
class DriverStep:
    """One period of a driver: the joints' state, and the commanded speeds (N,)."""

    state: JointState
    speeds: Floats
    reported: State


def serve_arm(
    arm: DrivenJoints,
    listener: socket.socket,
    settings: LinkSettings | None = None,
    *,
    watch: Callable[[DriverStep], None] = lambda _: None,
    is_over: Callable[[], bool] = lambda: False,
) -> None:
    """Drive an arm at rest, one loop at a time, until `is_over`; then bring it to rest.

    `listener` is a socket from `listening`. The arm's `command` sets the driver's pace, as it
    returns one period later. `watch` is called in every period.
    """
    settings = settings or LinkSettings()
    receiver = CommandReceiver(arm.joints, arm.period_s, settings)
    connection = _Connection(arm, listener, receiver)
    try:
        while not is_over():
            step = _step(arm, connection, receiver)
            watch(step)
            arm.command(step.speeds)
    finally:
        receiver.brake("the driver ends")
        try:
            _brake(arm, connection, receiver, watch)
        finally:
            connection.close()


def _step(arm: DrivenJoints, connection: "_Connection", receiver: CommandReceiver) -> DriverStep:
    state = arm.state()
    connection.receive(state)
    speeds = receiver.speeds(state)
    reported = _link_state(receiver, state)
    connection.send(reported)
    return DriverStep(state, speeds, reported)


def _brake(
    arm: DrivenJoints,
    connection: "_Connection",
    receiver: CommandReceiver,
    watch: Callable[[DriverStep], None],
) -> None:
    """Bring the arm to rest, even if the callback raises; its error is raised afterwards."""
    failed: Exception | None = None
    while not receiver.is_at_rest:
        step = _step(arm, connection, receiver)
        try:
            if failed is None:
                watch(step)
        except Exception as error:  # the arm is stopped first
            failed = error
        arm.command(step.speeds)
    if failed is not None:
        raise failed


class _Connection:
    """The connected loop, if any."""

    def __init__(
        self, arm: DrivenJoints, listener: socket.socket, receiver: CommandReceiver
    ) -> None:
        self._listener, self._receiver = listener, receiver
        self._lines: Lines | None = None
        self._welcome = line_of(_welcome(arm))

    def receive(self, state: JointState) -> None:
        """Process received messages, but at most one period's share."""
        self._read(state)
        self._accept()

    def _read(self, state: JointState) -> None:
        if self._lines is None:
            return
        for line in self._lines.taken(_MOST):
            self._receiver.take(from_loop(line), state)
        if self._lines.closed:
            self._receiver.end(f"the connection is closed: {self._lines.closed}")
            self._lines = None

    def send(self, state: State) -> None:
        """Send the joints' state to the loop, if it is connected."""
        if self._lines is not None:
            self._lines.send(line_of(state))

    def close(self) -> None:
        """Close the connection and the listener."""
        if self._lines is not None:
            self._lines.close()
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:  # no loop connects
            return
        lines = Lines(connection)
        if self._lines is not None and self._receiver.phase is Phase.RUNNING:
            lines.send(line_of(Busy()))
            lines.close()
            return
        if self._lines is not None:
            self._lines.close()  # the loop is no longer driving, and may not know it
        if connection.family == socket.AF_INET:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._lines = lines
        lines.send(self._welcome)


def _welcome(arm: DrivenJoints) -> Welcome:
    joints = arm.joints
    return Welcome(
        version=VERSION,
        names=list(joints.names),
        hand_count=joints.hand_count,
        lower=joints.lower.tolist(),
        upper=joints.upper.tolist(),
        speed=joints.speed.tolist(),
        acceleration=joints.acceleration.tolist(),
        jerk=None if joints.jerk is None else joints.jerk.tolist(),
        period_s=arm.period_s,
    )


def _link_state(receiver: CommandReceiver, state: JointState) -> State:
    return State(
        session=receiver.session,
        phase=receiver.phase,
        time_s=state.time_s,
        positions=np.asarray(state.positions, np.float64).tolist(),
        velocities=np.asarray(state.velocities, np.float64).tolist(),
        resting=receiver.is_at_rest,
        accepted=receiver.accepted,
        missing=receiver.missing,
        refused={one.name.lower(): count for one, count in receiver.refused.items()},
        ended=receiver.ended,
        stopped=state.stopped,
    )

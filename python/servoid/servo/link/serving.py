"""Drives an arm in a process of its own, by the commands that come over a socket."""

import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.servo.arm import Floats, Joints, JointState
from servoid.servo.link.lines import Lines
from servoid.servo.link.messages import VERSION, Busy, Phase, State, Welcome, from_loop, line_of
from servoid.servo.link.receiver import CommandReceiver
from servoid.servo.link.settings import LinkSettings

_MOST = 64  # messages in a period; others wait, and grow old


class DrivenJoints(Protocol):
    """What a driver needs of an arm: four members of `Arm`."""

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    @property
    def period_s(self) -> float:
        """Return for how long a command lasts, in seconds."""
        ...

    def state(self) -> JointState:
        """Return what the joints do now."""
        ...

    def command(self, velocities: Floats) -> None:
        """Have the joints turn at (N,) rad/s, and return one period later."""
        ...


@dataclass(frozen=True, eq=False)
class DriverStep:
    """One period of a driver: what the joints did, and the speeds (N,) that they are told now."""

    state: JointState
    speeds: Floats
    told: State


def serve_arm(
    arm: DrivenJoints,
    listener: socket.socket,
    settings: LinkSettings | None = None,
    *,
    watch: Callable[[DriverStep], None] = lambda _: None,
    is_over: Callable[[], bool] = lambda: False,
) -> None:
    """Drive an arm at rest, one loop at a time, until `is_over`; then bring it to rest.

    `listener` is what `listening` returns. The arm's `command` paces the driver, as it returns a
    period later. `watch` is called in every period.
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
    connection.hear(state)
    speeds = receiver.speeds(state)
    told = _told(receiver, state)
    connection.tell(told)
    return DriverStep(state, speeds, told)


def _brake(
    arm: DrivenJoints,
    connection: "_Connection",
    receiver: CommandReceiver,
    watch: Callable[[DriverStep], None],
) -> None:
    """Bring the arm to rest, even if who watches fails; that is raised then."""
    failed: Exception | None = None
    while not receiver.is_at_rest:
        step = _step(arm, connection, receiver)
        try:
            if failed is None:
                watch(step)
        except Exception as error:  # whatever it is, the arm comes first
            failed = error
        arm.command(step.speeds)
    if failed is not None:
        raise failed


class _Connection:
    """The loop that is connected, if there is one."""

    def __init__(
        self, arm: DrivenJoints, listener: socket.socket, receiver: CommandReceiver
    ) -> None:
        self._listener, self._receiver = listener, receiver
        self._lines: Lines | None = None
        self._welcome = line_of(_welcome(arm))

    def hear(self, state: JointState) -> None:
        """Take up what came, but no more than a period's work."""
        self._read(state)
        self._accept()

    def _read(self, state: JointState) -> None:
        if self._lines is None:
            return
        for line in self._lines.taken(_MOST):
            self._receiver.take(from_loop(line), state)
        if self._lines.closed:
            self._receiver.end(f"the connection is over: {self._lines.closed}")
            self._lines = None

    def tell(self, told: State) -> None:
        """Tell the loop what the joints do, unless it does not listen."""
        if self._lines is not None:
            self._lines.send(line_of(told))

    def close(self) -> None:
        """Close the connection and the listener."""
        if self._lines is not None:
            self._lines.close()
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:  # nobody asks
            return
        lines = Lines(connection)
        if self._lines is not None and self._receiver.phase is Phase.RUNNING:
            lines.send(line_of(Busy()))
            lines.close()
            return
        if self._lines is not None:
            self._lines.close()  # it drives no more, and may never have heard of it
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


def _told(receiver: CommandReceiver, state: JointState) -> State:
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

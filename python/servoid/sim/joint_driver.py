"""Simulates an arm's driver, without physics, behind a socket in a process of its own."""

import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TextIO

from servoid.pose import Floats
from servoid.servo import Joints, JointState
from servoid.servo.link import Address, DriverStep, LinkSettings, listening, serve_arm
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

PERIOD_S = 0.002


class PacedJoints:
    """Moves the joints of a simulated arm in real time.

    A period that takes longer is not caught up: the joints' own clock falls behind, and nothing
    moves meanwhile.
    """

    def __init__(self, arm: SerialArm) -> None:
        self._arm = arm
        self._next = time.monotonic()

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        return self._arm.joints

    @property
    def period_s(self) -> float:
        """Return the duration of a command in seconds."""
        return self._arm.period_s

    def state(self) -> JointState:
        """Return the present state of the joints, by their own clock."""
        return self._arm.state()

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return when a period is over."""
        self._arm.command(velocities)
        now = time.monotonic()
        self._next = max(self._next + self.period_s, now)
        time.sleep(self._next - now)


class DriverLog:
    """Writes a line for each period of a driver: joints, commands, and status of the link."""

    def __init__(self, file: TextIO, names: Sequence[str]) -> None:
        """Write the header to a file that flushes its lines."""
        self._file = file
        joints = [f"{kind}_{name}" for kind in ("q", "v", "told") for name in names]
        link = ["time_s", "session", "phase", "accepted", "missing", "refused"]
        file.write(",".join([*link, *joints]) + "\n")

    def add(self, step: DriverStep) -> None:
        """Write a period."""
        reported, state = step.reported, step.state
        link = [reported.session, reported.phase.value, reported.accepted, reported.missing]
        rows = (state.positions, state.velocities, step.speeds)
        joints = [repr(float(value)) for row in rows for value in row]
        values = [repr(state.time_s), *link, sum(reported.refused.values()), *joints]
        self._file.write(",".join(str(value) for value in values) + "\n")


def drive_joints(
    address: Address, log: str | Path | None = None, settings: LinkSettings | None = None
) -> None:
    """Drive a simulated PA-10 with two cameras by commands to an address, until interrupted.

    `log` is a CSV file of every period. Run it as the target of a process of its own.

    Raises:
        ServoError: it cannot listen at the address.

    """
    arm = SerialArm(read_arm(), PERIOD_S)
    with ExitStack() as stack:
        listener = stack.enter_context(listening(address))
        log_step = None
        if log is not None:
            file = stack.enter_context(Path(log).open("w", buffering=1, encoding="utf-8"))
            log_step = DriverLog(file, arm.joints.names).add
        serve_arm(PacedJoints(arm), listener, settings, watch=log_step or (lambda _: None))

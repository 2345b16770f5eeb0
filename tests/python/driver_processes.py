"""An arm's driver and a loop that drives it, each a process of its own, and the driver's log."""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from subprocess import PIPE, Popen
from threading import Event, Thread

import numpy as np
from linked_joints import SETTINGS
from numpy.typing import NDArray

from servoid.errors import ServoError
from servoid.servo.link import LinkedArm, StoppingTrajectory
from servoid.servo.link.messages import MotionCommand
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

Floats = NDArray[np.float64]
PATIENCE_S = 120.0  # on the wall, until a test that hangs fails
ARM = SerialArm(read_arm())
COUNT = len(ARM.joints.names)


@dataclass(frozen=True, eq=False)
class Row:
    """A period of the driver, by its own clock."""

    time_s: float
    session: str
    is_running: bool
    accepted: int
    refused: int
    velocities: Floats
    told: Floats


@dataclass
class Log:
    """The driver's log while it grows."""

    path: Path
    rows: list[Row] = field(default_factory=list)
    read: int = 0

    def update(self) -> list[Row]:
        """Read the lines that are whole by now."""
        if not self.path.exists():
            return self.rows
        with self.path.open("rb") as file:
            file.seek(self.read)
            text = file.read()
        whole = text[: text.rfind(b"\n") + 1]
        for line in whole.decode().splitlines():
            if not line.startswith("time_s"):
                self.rows.append(_row(line))
        self.read += len(whole)
        return self.rows

    def wait(self, until: Callable[[list[Row]], bool]) -> list[Row]:
        """Wait until the rows that come from now on satisfy a condition, and return them."""
        first, limit = len(self.update()), time.monotonic() + PATIENCE_S
        while not until(self.rows[first:]):
            assert time.monotonic() < limit, "the driver's log does not come so far"
            time.sleep(0.005)
            self.update()
        return self.rows[first:]


def _row(line: str) -> Row:
    time_s, session, phase, accepted, _, refused, *joints = line.split(",")
    _, velocities, told = np.array(joints, np.float64).reshape(3, COUNT)
    running = phase == "running"
    return Row(float(time_s), session, running, int(accepted), int(refused), velocities, told)


def is_at_rest(row: Row) -> bool:
    return not row.told.any() and bool(np.abs(row.velocities).max() < 1e-3)


@contextmanager
def driver(address: str, log: Path) -> Iterator[Popen[str]]:
    """Run a driver until the block ends."""
    call = f"drive_joints({address!r}, {str(log)!r})"
    with _process(["-c", f"from servoid.sim.joint_driver import drive_joints; {call}"]) as process:
        yield process


@contextmanager
def sender(address: str) -> Iterator[Popen[str]]:
    """Run a loop that swings the joints; it hears what to do on its standard input."""
    with _process([str(Path(__file__)), address]) as process:
        yield process


@contextmanager
def _process(arguments: list[str]) -> Iterator[Popen[str]]:
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    process = Popen([sys.executable, *arguments], stdin=PIPE, text=True, env=environment)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()


def say(process: Popen[str], word: str) -> None:
    assert process.stdin is not None
    process.stdin.write(word + "\n")
    process.stdin.flush()


class Ears:
    """What was said on the standard input."""

    def __init__(self) -> None:
        self.words = {word: Event() for word in ("close", "flood", "go")}
        Thread(target=self._hear, daemon=True).start()

    def _hear(self) -> None:
        for line in sys.stdin:
            self.words[line.strip()].set()

    def heard(self, word: str) -> bool:
        if not self.words[word].is_set():
            return False
        self.words[word].clear()
        return True

    def wait(self, word: str) -> None:
        self.words[word].wait()
        self.words[word].clear()


def swing(address: str) -> None:
    """Swing all joints; close the connection, or send old commands, when told to, until `go`."""
    ears = Ears()
    while True:
        arm = LinkedArm(ARM, address)
        while not ears.heard("close"):
            _swing_once(arm, ears)
        arm.close()
        ears.wait("go")


def _swing_once(arm: LinkedArm, ears: Ears) -> None:
    """Begin a session, and swing until it is over or something is said."""
    arm.start()
    try:
        for tick in range(10**9):
            if ears.words["close"].is_set():
                return
            if ears.heard("flood"):
                _flood(arm, ears)
                return
            ramp = min(1.0, tick * arm.period_s)
            phases = 3.0 * tick * arm.period_s + np.arange(COUNT)
            arm.state()
            arm.command(0.3 * ramp * arm.joints.speed * np.sin(phases))
    except ServoError as error:
        if "has ended the session" not in str(error):
            raise


def _flood(arm: LinkedArm, ears: Ears) -> None:
    """Send commands with new numbers that answer one old state, as fast as it goes."""
    told = arm.told
    motion = StoppingTrajectory.after(0.3 * arm.joints.speed, arm.joints, SETTINGS)
    number = 10**6
    while not ears.heard("go"):
        number += 1
        arm._driver.newest()
        arm._driver.send(
            MotionCommand(
                session=told.session if number % 2 else arm.told.session,
                number=number if number % 3 else 1,
                stamp_s=(told.time_s or 0.0) - SETTINGS.hold_s,
                times_s=motion.times_s.tolist(),
                speeds=motion.speeds.tolist(),
            )
        )


if __name__ == "__main__":
    swing(sys.argv[1])

"""A driver whose loop is killed, stopped, cut off, or gone mad; each is a process of its own.

The driver's log is judged, period by period of its own clock: not when this machine, which may be
busy, lets which process run, but what the driver did between the last command that counted and
rest. What counts as a moment of a fault is the last period in which a command was accepted.
"""

import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from subprocess import Popen

import numpy as np
import pytest
from driver_processes import ARM, Log, Row, driver, is_at_rest, send, sender
from linked_joints import SETTINGS

from servoid.servo.link import LinkedArm, MotionCommand, StoppingTrajectory
from servoid.sim.joint_driver import PERIOD_S

pytestmark = pytest.mark.extended
MOMENTS = 10
FLOOD = 500
SILENCE_S = 0.15
RESTING = round(0.3 / PERIOD_S)
Sender = Popen[str]


@pytest.fixture
def address() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:  # a Unix socket has a short name
        yield str(Path(folder) / "arm")


def moves(rows: list[Row], least: int) -> bool:
    """Say if the joints have moved for some commands, and do so now."""
    return bool(rows) and rows[-1].accepted >= least and np.abs(rows[-1].commanded).max() > 0.05


def rests(rows: list[Row]) -> bool:
    return len(rows) >= RESTING and all(is_at_rest(row) for row in rows[-RESTING:])


def times_of_commands(rows: list[Row]) -> list[int]:
    """Return the rows in which a command was accepted."""
    pairs = pairwise(rows)
    return [
        place
        for place, (before, now) in enumerate(pairs, 1)
        if now.accepted > before.accepted or (now.session != before.session and now.accepted)
    ]


def judged(rows: list[Row]) -> list[str]:
    """Say which laws of the link a driver's log breaks."""
    joints = ARM.joints
    commanded = np.array([row.commanded for row in rows])
    truly = np.array([row.velocities for row in rows])
    slopes = np.abs(np.diff(commanded, axis=0, prepend=0.0 * commanded[:1])) / PERIOD_S
    found = []
    if np.any(np.abs(commanded) > joints.speed) or np.any(np.abs(truly) > joints.speed):
        found.append("speed")
    if np.any(slopes > joints.acceleration * (1 + 1e-9)):
        found.append("acceleration")
    if any(row.is_running and row.accepted == 0 and row.commanded.any() for row in rows):
        found.append("moves before a fresh command")
    counted = set(times_of_commands(rows))
    last, allowed_s = 0, 0.0
    for place, row in enumerate(rows):
        if place in counted:
            braking = np.abs(row.commanded) / (SETTINGS.braking_share * joints.acceleration)
            last, allowed_s = place, SILENCE_S + float(braking.max())
        if (place - last) * PERIOD_S > allowed_s and row.commanded.any():
            found.append(f"moves {(place - last) * PERIOD_S:.3f} s after the last command")
            break
    return found


def stop_and_go_on(process: Sender, log: Log) -> None:
    process.send_signal(signal.SIGSTOP)
    log.wait(rests)
    process.send_signal(signal.SIGCONT)


def close_and_go_on(process: Sender, log: Log) -> None:
    send(process, "close")
    log.wait(rests)
    send(process, "go")


def flood_and_go_on(process: Sender, log: Log) -> None:
    send(process, "flood")
    log.wait(lambda rows: rests(rows) and rows[-1].refused - rows[0].refused > FLOOD)
    send(process, "go")


@pytest.mark.parametrize("fault", [stop_and_go_on, close_and_go_on, flood_and_go_on])
def test_joints_come_to_rest_whatever_becomes_of_a_loop_that_lives_on(
    fault: Callable[[Sender, Log], None], address: str, tmp_path: Path
) -> None:
    random = np.random.default_rng(5)
    log = Log(tmp_path / "driver.csv")
    with driver(address, log.path), sender(address) as process:
        for _ in range(MOMENTS):
            least = int(random.integers(20, 150))
            log.wait(lambda rows, least=least: moves(rows, least))
            fault(process, log)
    rows = log.update()
    assert judged(rows) == []
    sessions = {row.session for row in rows if row.commanded.any() and row.is_running}
    assert len(sessions) >= MOMENTS  # each motion after a fault was started anew


def test_joints_come_to_rest_when_their_loop_is_killed(address: str, tmp_path: Path) -> None:
    random = np.random.default_rng(6)
    log = Log(tmp_path / "driver.csv")
    with driver(address, log.path):
        for _ in range(MOMENTS):
            with sender(address) as process:
                least = int(random.integers(20, 150))
                log.wait(lambda rows, least=least: moves(rows, least))
                process.send_signal(signal.SIGKILL)
                log.wait(rests)
    rows = log.update()
    assert judged(rows) == []
    sessions = {row.session for row in rows if row.commanded.any() and row.is_running}
    assert len(sessions) >= MOMENTS


def test_a_driver_that_starts_anew_moves_nothing_without_a_start_and_a_fresh_command(
    address: str, tmp_path: Path
) -> None:
    before, after = Log(tmp_path / "before.csv"), Log(tmp_path / "after.csv")
    with driver(address, before.path) as process, sender(address):
        rows = before.wait(lambda rows: moves(rows, 40))
        process.send_signal(signal.SIGKILL)
    old = rows[-1]
    motion = StoppingTrajectory.after(0.2 * ARM.joints.speed, ARM.joints, SETTINGS)
    with ExitStack() as stack:
        stack.enter_context(driver(address, after.path))
        arm = LinkedArm(ARM, address)
        stack.callback(arm.close)
        # No start, and another driver's session.
        for session in (old.session, arm.last_state.session):
            for number in range(1, 50):
                arm._driver.listen()
                stamp_s = arm.last_state.time_s or 0.0
                arm._driver.send(
                    MotionCommand(
                        session=session,
                        number=old.accepted + number,
                        stamp_s=stamp_s,
                        times_s=motion.times_s.tolist(),
                        speeds=motion.speeds.tolist(),
                    )
                )
        after.wait(lambda rows: bool(rows) and rows[-1].refused >= 98)
        assert not any(row.commanded.any() for row in after.rows)
        arm.start()
        after.wait(lambda rows: bool(rows) and rows[-1].is_running)
        assert not any(row.commanded.any() for row in after.update())
        for tick in range(100):
            arm.state()
            arm.command(min(1.0, tick / 50) * 0.2 * ARM.joints.speed)
        after.wait(lambda rows: rests(rows))
    assert any(row.commanded.any() for row in after.rows)
    assert judged(after.rows) == []

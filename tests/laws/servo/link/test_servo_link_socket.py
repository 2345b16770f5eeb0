"""A loop and an arm's driver at the two ends of a socket, the driver in a thread of the test."""

import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread

import numpy as np
import pytest

from servoid.errors import ServoError
from servoid.servo import Arm, Joints
from servoid.servo.link import (
    Address,
    DriverStep,
    LinkedArm,
    LinkSettings,
    Phase,
    listening,
    serve_arm,
)
from servoid.servo.link.messages import Welcome, line_of
from servoid.sim.arm_file import read_arm
from servoid.sim.joint_driver import PERIOD_S, PacedJoints
from servoid.sim.serial_arm import SerialArm

MODEL = SerialArm(read_arm())
SLOWLY = 0.05 * MODEL.joints.speed
# A session outlasts whatever else this machine does; the laws of silence are tested elsewhere.
SETTINGS = LinkSettings(hold_s=20.0, first_s=60.0, silence_s=60.0, patience_s=60.0)


class Served:
    """A driver in a thread; `steps` are its periods."""

    def __init__(self, address: Address, settings: LinkSettings = SETTINGS) -> None:
        self.listener = listening(address)
        self.address: Address = self.listener.getsockname()
        self.steps, self.over = list[DriverStep](), Event()
        joints = PacedJoints(SerialArm(read_arm(), PERIOD_S))
        options = {"watch": self.steps.append, "is_over": self.over.is_set}
        self.thread = Thread(
            target=serve_arm, args=(joints, self.listener, settings), kwargs=options
        )
        self.thread.start()

    def end(self) -> None:
        self.over.set()
        self.thread.join()


@contextmanager
def served(address: Address, settings: LinkSettings = SETTINGS) -> Iterator[Served]:
    found = Served(address, settings)
    try:
        yield found
    finally:
        found.end()


@pytest.fixture(params=["unix", "tcp"])
def driver(request: pytest.FixtureRequest) -> Iterator[Served]:
    with tempfile.TemporaryDirectory() as folder:
        place = str(Path(folder) / "arm") if request.param == "unix" else ("127.0.0.1", 0)
        with served(place) as found:
            yield found


def test_it_is_an_arm_with_the_drivers_limits_and_the_models_geometry(driver: Served) -> None:
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        assert isinstance(arm, Arm)
        positions = arm.state().positions
        assert np.array_equal(arm.joints.speed, MODEL.joints.speed)
        assert np.array_equal(arm.jacobian(positions), MODEL.jacobian(positions))
        assert arm.eyes == MODEL.eyes


def test_joints_follow_commands_a_period_each(driver: Served) -> None:
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        times = []
        for _ in range(40):
            times.append(arm.state().time_s)
            arm.command(SLOWLY)
        assert arm.last_state.accepted > 30
        assert np.all(np.diff(times) > arm.period_s - PERIOD_S)
        np.testing.assert_allclose(arm.state().velocities, SLOWLY, rtol=0.01)


def test_a_driver_that_ends_brings_its_joints_to_rest_within_limits(driver: Served) -> None:
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        for _ in range(20):
            arm.command(6.0 * SLOWLY)
        driver.end()
        with pytest.raises(ServoError, match=r"the driver ends|is closed"):
            for _ in range(10**6):
                arm.state()
                arm.command(SLOWLY)
    commanded = np.array([step.speeds for step in driver.steps])
    assert np.abs(commanded).max() > 0.1
    assert not commanded[-1].any()
    slopes = np.abs(np.diff(commanded, axis=0)) / PERIOD_S
    assert np.all(slopes <= MODEL.joints.acceleration * (1 + 1e-9))


def test_a_driver_whose_watch_fails_brings_its_joints_to_rest_and_tells_the_failure() -> None:
    joints, listener = SerialArm(read_arm(), PERIOD_S), listening(("127.0.0.1", 0))
    address, full = listener.getsockname(), Event()
    failures: list[BaseException] = []
    commanded: list[np.ndarray] = []

    class Kept(PacedJoints):
        def command(self, velocities: np.ndarray) -> None:
            commanded.append(velocities)
            super().command(velocities)

    def watch(step: DriverStep) -> None:
        if np.abs(step.speeds).max() > 0.1:
            full.set()
        if full.is_set():
            raise OSError("no space left")

    def serve() -> None:
        try:
            serve_arm(Kept(joints), listener, SETTINGS, watch=watch)
        except OSError as error:
            failures.append(error)

    thread = Thread(target=serve)
    thread.start()
    with LinkedArm(MODEL, address, SETTINGS) as arm, pytest.raises(ServoError):
        for _ in range(1000):
            arm.command(6.0 * SLOWLY)
    thread.join()
    assert [str(one) for one in failures] == ["no space left"]
    # Once more than 0.1 was to be told, watching failed.
    assert np.abs(np.array(commanded)).max() > 0.05
    assert not commanded[-1].any()


def test_nothing_moves_before_the_start(driver: Served) -> None:
    arm = LinkedArm(MODEL, driver.address, SETTINGS)
    with pytest.raises(ServoError, match="the arm was not started; enter its context"):
        arm.command(SLOWLY)
    arm.start()
    arm.command(SLOWLY)
    arm.close()


def test_a_second_loop_is_refused_while_one_drives(driver: Served) -> None:
    with (
        LinkedArm(MODEL, driver.address, SETTINGS) as arm,
        pytest.raises(ServoError, match="is driven by another loop; end that first"),
    ):
        arm.command(SLOWLY)
        LinkedArm(MODEL, driver.address, SETTINGS)


def test_a_loop_that_does_not_drive_makes_room_for_another(driver: Served) -> None:
    idle = LinkedArm(MODEL, driver.address, SETTINGS)
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        arm.command(SLOWLY)
        with pytest.raises(ServoError, match="is closed"):
            idle.start()


def test_lines_that_are_no_messages_are_counted_and_nothing_else(driver: Served) -> None:
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        arm._driver._lines.send(b'hello\n{"type":"command"}\n\xff\xfe\n[[[[\n')
        while not arm.last_state.refused:
            arm.command(SLOWLY)
        assert arm.last_state.refused == {"no_message": 4}
        assert arm.last_state.phase is Phase.RUNNING


def test_a_line_without_an_end_ends_the_connection(driver: Served) -> None:
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        arm._driver._lines.send(b"x" * 200_000)
        with pytest.raises(ServoError, match="is closed"):
            for _ in range(10**6):
                arm.state()
                arm._driver.listen()
    with LinkedArm(MODEL, driver.address, SETTINGS) as arm:
        arm.command(SLOWLY)


@pytest.mark.parametrize("wrong", [[0.0], [np.nan] * 10, [np.inf] * 10])
def test_speeds_that_are_no_speeds_are_refused(wrong: list[float]) -> None:
    with (
        served(("127.0.0.1", 0)) as driver,
        LinkedArm(MODEL, driver.address, SETTINGS) as arm,
        pytest.raises(ServoError, match="10 finite joint speeds are needed"),
    ):
        arm.command(np.array(wrong))


class Other(SerialArm):
    @property
    def joints(self) -> Joints:
        return replace(super().joints, names=tuple("abcdefghij"))


def test_another_arms_driver_and_too_short_periods_are_refused() -> None:
    with served(("127.0.0.1", 0)) as driver:
        with pytest.raises(ServoError, match=r"drives the joints s1, s2, .* the model has a, b"):
            LinkedArm(Other(read_arm()), driver.address, SETTINGS)
        with pytest.raises(ServoError, match=r"0\.001 s was asked for, but .* has one of 0\.002 s"):
            LinkedArm(MODEL, driver.address, SETTINGS, period_s=0.001)


def test_a_session_that_lapsed_says_why_and_begins_again_when_started() -> None:
    short = LinkSettings(first_s=0.01)
    with (
        served(("127.0.0.1", 0), short) as driver,
        LinkedArm(MODEL, driver.address, SETTINGS) as arm,
    ):
        while arm.last_state.phase is Phase.RUNNING:
            arm._driver.listen()
        with pytest.raises(
            ServoError, match=r"ended the session: no command came in time; .*start"
        ):
            arm.command(SLOWLY)
        arm.start()
        assert arm.last_state.phase is Phase.RUNNING


def test_no_driver_a_silent_one_and_one_of_another_version_are_told() -> None:
    hasty = LinkSettings(patience_s=0.01, silence_s=0.01)
    listener = listening(("127.0.0.1", 0))
    place = listener.getsockname()
    with pytest.raises(ServoError, match=r"has sent nothing for 0.01 s; check whether it hangs"):
        LinkedArm(MODEL, place, hasty)
    listener.setblocking(True)
    connection, _ = listener.accept()

    def welcome() -> None:
        connection, _ = listener.accept()
        limits = {name: [1.0] for name in ("lower", "upper", "speed", "acceleration")}
        new = Welcome(version=9, names=["a"], hand_count=1, period_s=0.01, **limits)
        connection.sendall(line_of(new))

    thread = Thread(target=welcome)
    thread.start()
    with pytest.raises(ServoError, match="does not speak version 1 of servoid's protocol"):
        LinkedArm(MODEL, place, SETTINGS)
    thread.join()
    connection.close()
    listener.close()
    with pytest.raises(ServoError, match=r"no arm's driver answers at 127\.0\.0\.1:\d+: "):
        LinkedArm(MODEL, place, hasty)


def test_an_address_in_use_is_told_and_one_of_a_killed_driver_is_taken_over() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "arm")
        with (
            listening(path),
            pytest.raises(ServoError, match=r"cannot listen at .*address already"),
        ):
            listening(path)
        assert Path(path).is_socket()  # as a driver that was killed leaves it
        with listening(path), socket.socket(socket.AF_UNIX) as probe:
            probe.connect(path)

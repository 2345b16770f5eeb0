"""Recordings as sources, and arms that servo with recordings and live cameras."""

from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from fake_tracker import FakeTracker, plain_body
from played_sources import (
    PERIOD_S,
    FakeClock,
    FakeVideo,
    rig,
    write_capture,
)
from servo_loop import GOAL_FROM_OBJECT, WORLD_FROM_OBJECT

from servoid.errors import CaptureError, ServoError
from servoid.pose import Pose
from servoid.servo import (
    Controller,
    JointState,
    Reason,
    RememberingArm,
    Tick,
    brought_to_rest,
    servo,
)
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source import Live, LiveSettings, Recording, Source


def test_a_recording_ends_with_its_last_observation(tmp_path: Path) -> None:
    clock = FakeClock()
    source = Recording(write_capture(tmp_path, 12), clock)
    first = source.newest()
    assert first is not None and first.time_s == clock()
    clock.advance(5.0)
    last = source.newest()
    assert last is not None and (last.index, source.is_over) == (11, True)
    assert last.time_s == pytest.approx(first.time_s + 11 / 30)
    assert source.newest() is None


def test_a_recording_plays_at_its_own_times_where_it_knows_them(tmp_path: Path) -> None:
    poses = "time_s,x,y,z,qw,qx,qy,qz\n"
    poses += "".join(f"{3.0 + 0.1 * k**2},{k},0,0,1,0,0,0\n" for k in range(4))
    tmp_path.joinpath("poses.csv").write_text(poses)
    clock = FakeClock(0.0)
    capture = write_capture(tmp_path, 4, rate='[rig]\nposes = "poses.csv"')
    source = Recording(capture, clock)
    found = []
    for _ in range(200):
        instant = source.newest()
        if instant is not None:
            found.append((instant.time_s, instant.world_from_camera[0].translation[0]))
        clock.advance()
    assert found == [pytest.approx((0.1 * k**2, k)) for k in range(4)]


def test_a_recording_without_times_must_be_told_its_rate(tmp_path: Path) -> None:
    capture = write_capture(tmp_path, 3, rate="")
    with pytest.raises(CaptureError, match="has neither times nor a rate"):
        Recording(capture, FakeClock())
    assert Recording(capture, FakeClock(), rate_hz=10.0).newest() is not None


def test_a_rate_of_zero_is_refused_even_if_the_recording_knows_one(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="the rate is not positive"):
        Recording(write_capture(tmp_path, 3), FakeClock(), rate_hz=0.0)


def test_times_that_do_not_increase_are_refused(tmp_path: Path) -> None:
    rows = "".join(f"{time_s},0,0,0,1,0,0,0\n" for time_s in (0.0, 0.2, 0.1))
    tmp_path.joinpath("poses.csv").write_text(f"time_s,x,y,z,qw,qx,qy,qz\n{rows}")
    capture = write_capture(tmp_path, 3, rate='[rig]\nposes = "poses.csv"')
    with pytest.raises(CaptureError, match=r"observation 2 was taken at 0.1 s, which is not after"):
        Recording(capture, FakeClock())


def test_cameras_on_a_hand_are_where_the_arm_was_when_images_were_taken() -> None:
    arm = RememberingArm(SerialArm(read_arm()))
    clock = FakeClock(arm.state().time_s)
    videos = FakeVideo(clock), FakeVideo(clock)
    with Live(
        rig(*videos),
        clock=clock,
        world_from_cameras=arm.world_from_cameras_at,
        settings=LiveSettings(delay_s=0.025),
    ) as source:
        slowly, found = np.full(len(arm.joints.names), 0.3), 0
        for _ in range(80):
            arm.command(slowly)
            arm.state()
            clock.advance(arm.period_s)
            instant = source.newest()
            if instant is not None:
                found += 1
                there = arm.world_from_cameras(arm.positions_at(instant.time_s))
                for pose, expected in zip(instant.world_from_camera, there, strict=True):
                    assert pose.translation == pytest.approx(expected.translation)
        for video in videos:
            video.closed = True
    assert found > 15


class Ticking(RememberingArm):
    """An arm with which a clock goes on."""

    def __init__(self, clock: FakeClock) -> None:
        super().__init__(SerialArm(read_arm(), PERIOD_S))
        self.clock, clock.time_s = clock, self.state().time_s

    def command(self, velocities: np.ndarray) -> None:
        super().command(velocities)
        self.clock.advance(self.period_s)


class Knowing(FakeTracker):
    made: ClassVar[list[FakeTracker]] = []


def servo_with(arm: Ticking, source: Source, seconds: float) -> list[Tick]:
    """Servo to an object at rest that the tracker knows, 30 mm off its goal."""
    tracker = Knowing(source.cameras, plain_body(WORLD_FROM_OBJECT))
    controller, ticks = Controller(arm), []
    off = Pose.from_parts([0.03, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    end = arm.state().time_s + seconds
    with brought_to_rest(arm, controller):
        for tick in servo(arm, source, tracker, controller, lambda _: off @ GOAL_FROM_OBJECT):  # type: ignore
            ticks.append(tick)
            if tick.state.time_s > end:
                break
    return ticks


def hand_off_goal(arm: Ticking) -> float:
    hand = arm.world_from_hand(arm.state().positions)
    goal = WORLD_FROM_OBJECT @ GOAL_FROM_OBJECT.inverse()
    off = Pose.from_parts([-0.03, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    return float(np.linalg.norm(((goal @ off).inverse() @ hand).translation))


@pytest.mark.extended
def test_an_arm_servos_with_live_cameras_and_is_held_when_they_fall_silent() -> None:
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
    clock = FakeClock()
    arm = Ticking(clock)
    videos = FakeVideo(clock, lost=range(90, 999)), FakeVideo(clock, lost=range(60, 999))
    rigged = {"clock": clock, "world_from_cameras": arm.world_from_cameras_at}
    with Live(rig(*videos), **rigged) as source:
        ticks = servo_with(arm, source, 4.0)
        for video in videos:
            video.closed = True
    assert hand_off_goal(arm) < 0.001
    # One eye is enough, and the other was missed from 2 s on.
    assert not any(tick.command.holding for tick in ticks if 0.5 < tick.state.time_s < 2.9)
    assert Reason.NO_IMAGES in ticks[-1].command.holding
    assert not ticks[-1].command.velocities[:7].any()


def test_an_arm_servos_to_what_a_recording_shows(tmp_path: Path) -> None:
    pytest.importorskip("daqp", reason="servoing within all limits needs daqp")
    arm = Ticking(FakeClock())
    source = Recording(write_capture(tmp_path, 90), arm.clock)
    ticks = servo_with(arm, source, 2.5)
    assert hand_off_goal(arm) < 0.001
    assert sum(tick.instant is not None for tick in ticks) == pytest.approx(75, abs=2)


def test_an_arm_remembers_where_its_joints_were_between_its_states() -> None:
    arm = RememberingArm(SerialArm(read_arm()), seconds=0.1)
    states = []
    for _ in range(30):
        states.append(arm.state())
        arm.command(np.full(len(arm.joints.names), 0.2))
    middle = 0.5 * (states[-1].time_s + states[-2].time_s)
    expected = 0.5 * (states[-1].positions + states[-2].positions)
    assert arm.positions_at(middle) == pytest.approx(expected)
    assert arm.positions_at(np.inf) == pytest.approx(states[-1].positions)
    assert arm.positions_at(0.0)[1] > states[3].positions[1]  # what is older is forgotten


def test_an_arm_whose_clock_begins_anew_is_remembered_from_then_on() -> None:
    class Restarted(SerialArm):
        early_s = 0.0

        def state(self) -> JointState:
            state = super().state()
            return JointState(state.time_s - self.early_s, state.positions, state.velocities)

    inner = Restarted(read_arm())
    arm = RememberingArm(inner)
    for tick in range(40):
        inner.early_s = 0.0 if tick < 20 else 0.1
        state = arm.state()
        arm.command(np.full(len(arm.joints.names), 0.2))
    assert arm.positions_at(np.inf) == pytest.approx(state.positions)


def test_an_arm_that_does_not_know_where_it_is_cannot_be_remembered() -> None:
    class Lost(SerialArm):
        def state(self) -> JointState:
            state = super().state()
            return JointState(state.time_s, state.positions * np.nan, state.velocities)

    with pytest.raises(ServoError, match="are not finite"):
        RememberingArm(Lost(read_arm()))

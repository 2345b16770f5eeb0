"""Tracking and control in two threads; time is that of the arm's clock, order that of events."""

import time
from threading import Event

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from servo_loop import GOAL_FROM_OBJECT, WORLD_FROM_OBJECT

from servoid.errors import ServoError, TrackError
from servoid.pose import Pose
from servoid.servo import (
    Controller,
    Perception,
    Reason,
    Tick,
    TrackedInstant,
    TrackingInTurn,
    TrackingThread,
    brought_to_rest,
    servo_tracked,
)
from servoid.servo.perception import _KEPT
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source import Instant

PATIENCE_S = 30.0  # until a test that hangs fails
IMAGE_S = 1 / 30
OFF = Pose.from_parts([0.03, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]) @ GOAL_FROM_OBJECT


class Cameras:
    """A source of observations that a test takes, one after another."""

    cameras = ()

    def __init__(self, arm: SerialArm) -> None:
        self.arm, self.taken, self.waiting = arm, 0, list[Instant]()
        self.random = np.random.default_rng(0)

    def take(self) -> None:
        image = self.random.integers(0, 255, (8, 8, 3)).astype(np.uint8)
        poses = self.arm.world_from_cameras(self.arm.state().positions)
        self.waiting.append(Instant(self.taken, self.arm.time_s, poses, (image, image)))
        self.taken += 1

    def newest(self) -> Instant | None:
        found = None
        while self.waiting:
            found = self.waiting.pop(0)
        return found


class Knowing:
    """A tracker that knows where the object is, and returns when it is let go."""

    def __init__(self, error: BaseException | None = None) -> None:
        self.began, self.go_on, self.error = Event(), Event(), error
        self.go_on.set()

    def step(self, time_s: float, _poses: object, _images: object) -> FakeEstimate:
        self.began.set()
        assert self.go_on.wait(PATIENCE_S), "the control side waited for the tracker"
        if self.error is not None:
            raise self.error
        return FakeEstimate(time_s, WORLD_FROM_OBJECT)


class Waiting:
    """Hands over what a thread tracks, but not before all that was taken is tracked."""

    def __init__(self, cameras: Cameras, tracking: TrackingThread) -> None:
        self.cameras, self.tracking, self.count = cameras, tracking, 0

    def tracked(self) -> tuple[TrackedInstant, ...]:
        found = ()
        while self.count + len(found) < self.cameras.taken:
            found += self.tracking.tracked()
        self.count += len(found)
        return found


def follow(
    arm: SerialArm, cameras: Cameras, perception: Perception, ticks: int, every_s: float = IMAGE_S
) -> list[Tick]:
    """Servo for some ticks, taking images at their rate."""
    found = list[Tick]()
    steps = servo_tracked(arm, perception, Controller(arm), lambda _: OFF)
    for _ in range(ticks):
        while cameras.taken * every_s <= arm.time_s:
            cameras.take()
        found.append(next(steps))
    return found


def test_no_tick_waits_for_a_tracker_that_takes_90_ms() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras = Cameras(arm)
    looks = round(0.09 / arm.period_s)
    with TrackingThread(cameras, tracker) as tracking:
        steps = servo_tracked(arm, Waiting(cameras, tracking), Controller(arm), lambda _: OFF)
        for _ in range(20):
            cameras.take()
            next(steps)
        steps = servo_tracked(arm, tracking, Controller(arm), lambda _: OFF)
        tracker.go_on.clear()
        tracker.began.clear()
        cameras.take()
        stamp_s = arm.time_s
        assert tracker.began.wait(PATIENCE_S)
        # The tracker is at work now, and is let go only when as many periods have passed.
        while_at_work = [next(steps) for _ in range(looks)]
        tracker.go_on.set()
        tick = next(steps)
        while tick.instant is None:
            tick = next(steps)
    assert [one.instant for one in while_at_work] == [None] * looks
    times = [one.state.time_s for one in while_at_work]
    np.testing.assert_allclose(np.diff(times), arm.period_s, rtol=1e-6)
    assert tick.instant.time_s == pytest.approx(stamp_s)
    assert tick.state.time_s - stamp_s >= 0.09 - arm.period_s


def test_both_ways_to_track_command_the_same_bits() -> None:
    commands = []
    for threaded in (False, True):
        arm, tracker = SerialArm(read_arm()), Knowing()
        cameras = Cameras(arm)
        if threaded:
            with TrackingThread(cameras, tracker) as tracking:
                ticks = follow(arm, cameras, Waiting(cameras, tracking), 150)
        else:
            ticks = follow(arm, cameras, TrackingInTurn(cameras, tracker), 150)
        commands.append(np.array([tick.command.velocities for tick in ticks]))
    assert np.abs(commands[0]).max() > 0.02
    assert np.array_equal(*commands)


def test_the_newest_observation_wins_and_those_before_it_are_counted() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras = Cameras(arm)
    with TrackingThread(cameras, tracker) as tracking:
        tracker.go_on.clear()
        cameras.take()
        assert tracker.began.wait(PATIENCE_S)
        for _ in range(4):  # while the first one is being tracked
            arm.command(np.zeros(len(arm.joints.names)))
            cameras.take()
        tracker.go_on.set()
        found = ()
        while len(found) < 2:
            found += tracking.tracked()
    assert [one.instant.index for one in found] == [0, 4]
    assert [one.dropped for one in found] == [0, 3]
    assert [one.estimate.time_s for one in found] == [one.instant.time_s for one in found]  # type: ignore[union-attr]


def test_estimates_come_in_order_and_what_is_not_asked_for_in_time_is_counted() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras = Cameras(arm)
    many = _KEPT + 5
    with TrackingThread(cameras, tracker) as tracking:
        for _ in range(many):
            tracker.began.clear()
            cameras.take()
            assert tracker.began.wait(PATIENCE_S)
        tracker.began.clear()
        cameras.take()  # when it is begun, all before it are kept or dropped
        assert tracker.began.wait(PATIENCE_S)
        found = tracking.tracked()
    numbers = [one.instant.index for one in found]
    assert len(found) <= _KEPT
    assert numbers == sorted(numbers)
    assert numbers[-1] >= many - 1
    assert len(found) + sum(one.dropped for one in found) == numbers[-1] + 1


def test_a_tick_holds_all_that_it_heard() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras = Cameras(arm)
    with TrackingThread(cameras, tracker) as tracking:
        for _ in range(3):
            tracker.began.clear()
            cameras.take()
            assert tracker.began.wait(PATIENCE_S)
        tick = next(servo_tracked(arm, Waiting(cameras, tracking), Controller(arm), lambda _: OFF))
    assert tick.instant is not None
    numbers = [*(one.instant.index for one in tick.earlier), tick.instant.index]
    assert numbers == [0, 1, 2]
    assert tick.dropped == 0


def test_an_arm_whose_tracker_hangs_is_brought_to_rest_within_its_limits() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras, controller = Cameras(arm), Controller(arm)
    with TrackingThread(cameras, tracker) as tracking:
        steps = servo_tracked(arm, Waiting(cameras, tracking), controller, lambda _: OFF)
        while arm.time_s < 0.5:
            cameras.take()
            next(steps)
        tracker.go_on.clear()
        steps = servo_tracked(arm, tracking, controller, lambda _: OFF)
        moving = next(steps).command.velocities
        ticks = [next(steps) for _ in range(round(0.8 / arm.period_s))]
        tracker.go_on.set()
    assert np.abs(moving).max() > 0.02
    assert Reason.NO_IMAGES in ticks[-1].command.holding
    assert not ticks[-1].command.velocities[: arm.joints.hand_count].any()
    speeds = np.array([moving, *(tick.command.velocities for tick in ticks)])
    steps_up = np.abs(np.diff(speeds, axis=0)) / arm.period_s
    assert np.all(steps_up <= arm.joints.acceleration * (1 + 1e-9))


def test_a_tracker_that_hangs_is_told_as_such_and_images_that_do_not_come_are_not() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras, controller = Cameras(arm), Controller(arm)
    with TrackingThread(cameras, tracker) as tracking:
        steps = servo_tracked(arm, Waiting(cameras, tracking), controller, lambda _: OFF)
        while arm.time_s < 0.5:
            cameras.take()
            next(steps)
        steps = servo_tracked(arm, tracking, controller, lambda _: OFF)
        silent = [next(steps) for _ in range(round(0.8 / arm.period_s))][-1]
        tracker.began.clear()
        tracker.go_on.clear()
        cameras.take()
        assert tracker.began.wait(PATIENCE_S)
        time.sleep(0.6)
        hanging = next(steps)
        tracker.go_on.set()
        answered = next(steps)
        while answered.estimate is None:
            answered = next(steps)
    assert Reason.NO_IMAGES in silent.command.holding
    assert Reason.UNANSWERED not in silent.command.holding
    assert Reason.UNANSWERED in hanging.command.holding
    assert Reason.NO_IMAGES not in hanging.command.holding
    assert 0.6 <= hanging.busy_s < PATIENCE_S
    assert Reason.UNANSWERED not in answered.command.holding
    assert answered.busy_s == 0.0


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (TrackError("2 images are needed, but got 1"), "tracking failed: 2 images are needed"),
        (MemoryError(), "tracking failed: MemoryError"),
        (SystemExit(3), r"the tracker ended its thread by SystemExit \(3\)"),
        (KeyboardInterrupt(), "the tracker ended its thread by KeyboardInterrupt"),
    ],
)
def test_an_error_in_the_tracking_thread_ends_the_loop_with_an_arm_at_rest(
    error: BaseException, message: str
) -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras, controller = Cameras(arm), Controller(arm)
    commanded = list[np.ndarray]()
    with (
        pytest.raises(ServoError, match=message) as raised,
        TrackingThread(cameras, tracker) as tracking,
        brought_to_rest(arm, controller, lambda one: commanded.append(one.velocities)),
    ):
        for tick in servo_tracked(arm, Waiting(cameras, tracking), controller, lambda _: OFF):
            last = tick.command.velocities
            if arm.time_s > 0.5:
                tracker.error = error
            cameras.take()
    assert raised.value.__cause__ is error
    speeds = np.array([last, *commanded])
    assert np.abs(last).max() > 0.02
    assert np.all(np.abs(np.diff(speeds, axis=0)) <= arm.period_s * arm.joints.acceleration * 1.001)
    assert not commanded[-1].any()


def test_what_was_tracked_before_an_error_is_handed_over_first() -> None:
    arm, tracker = SerialArm(read_arm()), Knowing()
    cameras = Cameras(arm)
    with TrackingThread(cameras, tracker) as tracking:
        cameras.take()
        assert tracker.began.wait(PATIENCE_S)
        tracker.error = None
        waiting = Waiting(cameras, tracking)
        assert len(waiting.tracked()) == 1
        tracker.error = TrackError("no")
        cameras.take()
        with pytest.raises(ServoError, match="tracking failed: no"):
            waiting.tracked()


def test_a_thread_that_was_closed_says_so() -> None:
    arm = SerialArm(read_arm())
    with TrackingThread(Cameras(arm), Knowing()) as tracking:
        assert tracking.tracked() == ()
    with pytest.raises(ServoError, match="tracking was closed"):
        tracking.tracked()


class SlowOnce(Knowing):
    """A tracker during one of whose steps an arm moves on for some periods, as a real one does."""

    def __init__(self, arm: SerialArm, step: int, periods: int) -> None:
        super().__init__()
        self.arm, self.left, self.periods = arm, step, periods

    def step(self, time_s: float, _poses: object, _images: object) -> FakeEstimate:
        if self.left == 0:
            for _ in range(self.periods):
                self.arm.command(self.arm.state().velocities)
        self.left -= 1
        return super().step(time_s, _poses, _images)


@pytest.mark.parametrize(("periods", "is_told"), [(0, False), (2, False), (40, True)])
def test_a_search_for_which_the_arm_waited_is_told_as_a_late_command(
    periods: int, is_told: bool
) -> None:
    arm = SerialArm(read_arm())
    cameras = Cameras(arm)
    tracking = TrackingInTurn(cameras, SlowOnce(arm, 10, periods))
    ticks = follow(arm, cameras, tracking, 100)
    late = [tick for tick in ticks if Reason.LATE in tick.command.limiting]
    assert len(late) == int(is_told)

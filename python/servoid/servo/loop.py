"""The loop of visual servoing: observe, track, servo, act, again and again."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from servoid.observe.source import Instant, Source
from servoid.pose import Pose
from servoid.servo.arm import Arm, JointState
from servoid.servo.controller import Command, Controller
from servoid.track import Estimate, Follower, depths_for

Goal = Callable[[float], Pose | None]


@dataclass(frozen=True, eq=False)
class Tick:
    """One control period: what was known, what was done, and how long the thinking took.

    `instant` and `estimate` are there when an observation arrived in this period. `control_s` is
    the time, on the wall, that the control law took, and `track_s` what the tracker took.
    """

    state: JointState
    instant: Instant | None
    estimate: Estimate | None
    command: Command
    control_s: float
    track_s: float


def servo(
    arm: Arm, source: Source, tracker: Follower, controller: Controller, goal: Goal
) -> Iterator[Tick]:
    """Servo until the caller stops asking: each tick is one control period, as in Fig. 5.

    `goal` gives the desired relation `goal_from_object` at a time of the arm's clock, or None for a
    hand that rests. The tracker must have started. When the caller leaves the loop, the arm is
    still moving at the speeds of the last command; `brought_to_rest` and `halt` brake it.
    """
    while True:
        state = arm.state()
        instant = source.newest()
        began = time.perf_counter()
        estimate = None if instant is None else _track(tracker, instant)
        tracked = time.perf_counter()
        if instant is not None:
            state = arm.state()  # tracking took its time, in which a real arm went on
        if instant is not None:
            controller.see(instant, estimate)
        command = controller.command(state, goal(state.time_s))
        done = time.perf_counter()
        arm.command(command.velocities)
        yield Tick(state, instant, estimate, command, done - tracked, tracked - began)


def halt(arm: Arm, controller: Controller) -> Iterator[Command]:
    """Bring hand and eyes to rest within their limits; each command is one control period."""
    while True:
        command = controller.rest(arm.state())
        arm.command(command.velocities)
        yield command
        if not command.velocities.any():
            return


@contextmanager
def brought_to_rest(
    arm: Arm, controller: Controller, watch: Callable[[Command], None] = lambda _: None
) -> Iterator[None]:
    """Halt the arm when the block ends, however it ends: by an error or an interrupt, too.

    `watch` hears of each command that brakes it. If it raises, the arm is braked all the same.
    """
    try:
        yield
    finally:
        braking = halt(arm, controller)
        try:
            for command in braking:
                watch(command)
        finally:
            for _ in braking:
                pass


def _track(tracker: Follower, instant: Instant) -> Estimate | None:
    """Return where the target was, None if no camera delivered an image."""
    if instant.is_dark:
        return None
    seen = (instant.time_s, instant.world_from_camera, instant.images)
    return tracker.step(*seen, **depths_for(tracker, instant))

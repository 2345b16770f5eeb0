"""The loop of visual servoing: observe, track, control, act."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from servoid.pose import Pose
from servoid.servo.arm import Arm, JointState
from servoid.servo.controller import Command, Controller
from servoid.servo.perception import Perception, TrackedInstant, TrackingInTurn
from servoid.source import Instant, Source
from servoid.track import Estimate, Follower

Goal = Callable[[float], Pose | None]


@dataclass(frozen=True, eq=False)
class Tick:
    """One control period: inputs, command, and computing times.

    `instant` and `estimate` are set if the loop received an observation in this period; of several,
    they are the newest, and `earlier` contains the others. `control_s` is the wall-clock time of
    the control law, `track_s` that of the tracker for the newest. `dropped` counts the observations
    that arrived and were never tracked.
    """

    state: JointState
    instant: Instant | None
    estimate: Estimate | None
    command: Command
    control_s: float
    track_s: float
    earlier: tuple[TrackedInstant, ...] = ()
    dropped: int = 0


def servo(
    arm: Arm, source: Source, tracker: Follower, controller: Controller, goal: Goal
) -> Iterator[Tick]:
    """Servo until the caller stops iterating: each tick is one control period, as in Fig. 5.

    `goal` returns the desired pose `goal_from_object` at a time of the arm's clock, or None if the
    hand should rest. The tracker must have started. The arm waits for the tracker, so that a
    simulated run is repeatable; for a real arm use `servo_tracked` with a `TrackingThread`. When
    the caller leaves the loop, the arm still moves at the speeds of the last command;
    `brought_to_rest` and `halt` brake it.
    """
    return servo_tracked(arm, TrackingInTurn(source, tracker), controller, goal)


def servo_tracked(
    arm: Arm, perception: Perception, controller: Controller, goal: Goal
) -> Iterator[Tick]:
    """Servo as `servo` does, with estimates from a `Perception`.

    Raises:
        ServoidError: tracking has failed.

    """
    while True:
        state = arm.state()
        tracked = perception.tracked()
        if tracked:
            state = arm.state()  # a real arm moved on while tracking took its time
        began = time.perf_counter()
        for one in tracked:
            controller.see(one.instant, one.estimate)
        command = controller.command(state, goal(state.time_s))
        control_s = time.perf_counter() - began
        arm.command(command.velocities)
        yield _tick(state, tracked, command, control_s)


def halt(arm: Arm, controller: Controller) -> Iterator[Command]:
    """Bring hand and cameras to rest within their limits; each command is one control period.

    An arm that its own driver has stopped gets a single command of zero speeds.
    """
    while True:
        state = arm.state()
        command = controller.rest(state)
        if state.stopped:
            # After a reset, the arm must not resume the last command.
            command = replace(command, velocities=np.zeros_like(command.velocities))
        arm.command(command.velocities)
        yield command
        if not command.velocities.any():
            return


@contextmanager
def brought_to_rest(
    arm: Arm, controller: Controller, watch: Callable[[Command], None] = lambda _: None
) -> Iterator[None]:
    """Halt the arm when the block ends, also by an error or an interrupt.

    `watch` is called with each braking command. If it raises, the arm is still braked.
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


def _tick(
    state: JointState, tracked: tuple[TrackedInstant, ...], command: Command, control_s: float
) -> Tick:
    if not tracked:
        return Tick(state, None, None, command, control_s, 0.0)
    *earlier, newest = tracked
    return Tick(
        state,
        newest.instant,
        newest.estimate,
        command,
        control_s,
        newest.track_s,
        tuple(earlier),
        sum(one.dropped for one in tracked),
    )

"""The loop of visual servoing: observe, track, servo, act, again and again."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from servoid.pose import Pose
from servoid.servo.arm import Arm, JointState
from servoid.servo.controller import Command, Controller
from servoid.servo.perception import Perception, TrackedInstant, TrackingInTurn
from servoid.source.source import Instant, Source
from servoid.track import Estimate, Follower

Goal = Callable[[float], Pose | None]


@dataclass(frozen=True, eq=False)
class Tick:
    """One control period: what was known, what was done, and how long the thinking took.

    `instant` and `estimate` are there when the loop heard of an observation in this period; if of
    several, they are the newest, and `earlier` holds those before it. `control_s` is the time, on
    the wall, that the control law took, `track_s` what the tracker took for the newest. `dropped`
    counts the observations that arrived and were never tracked.
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
    """Servo until the caller stops asking: each tick is one control period, as in Fig. 5.

    `goal` gives the desired relation `goal_from_object` at a time of the arm's clock, or None for a
    hand that rests. The tracker must have started. The arm waits for the tracker, so that a
    simulated run can be repeated; a real arm has better `servo_tracked` and a `TrackingThread`.
    When the caller leaves the loop, the arm is still moving at the speeds of the last command;
    `brought_to_rest` and `halt` brake it.
    """
    return servo_tracked(arm, TrackingInTurn(source, tracker), controller, goal)


def servo_tracked(
    arm: Arm, perception: Perception, controller: Controller, goal: Goal
) -> Iterator[Tick]:
    """Servo to what is tracked elsewhere, as `servo` does.

    Raises:
        ServoidError: tracking has failed.

    """
    while True:
        state = arm.state()
        heard = perception.tracked()
        if heard:
            state = arm.state()  # tracking may have taken its time, in which a real arm went on
        began = time.perf_counter()
        for one in heard:
            controller.see(one.instant, one.estimate)
        command = controller.command(state, goal(state.time_s))
        control_s = time.perf_counter() - began
        arm.command(command.velocities)
        yield _tick(state, heard, command, control_s)


def halt(arm: Arm, controller: Controller) -> Iterator[Command]:
    """Bring hand and eyes to rest within their limits; each command is one control period.

    An arm that its own driver has stopped is left to that: it is commanded to rest, once.
    """
    while True:
        state = arm.state()
        command = controller.rest(state)
        if state.stopped:
            # Whoever resets it must not set free what was commanded last.
            command = replace(command, velocities=np.zeros_like(command.velocities))
        arm.command(command.velocities)
        yield command
        if not command.velocities.any():
            return


@contextmanager
def brought_to_rest(
    arm: Arm, controller: Controller, watch: Callable[[Command], None] = lambda _: None
) -> Iterator[None]:
    """Halt the arm when the block ends, however it ends: by an error or an interrupt, too.

    `watch` is called with each braking command. If it raises, the arm is braked all the same.
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
    state: JointState, heard: tuple[TrackedInstant, ...], command: Command, control_s: float
) -> Tick:
    if not heard:
        return Tick(state, None, None, command, control_s, 0.0)
    *earlier, newest = heard
    return Tick(
        state,
        newest.instant,
        newest.estimate,
        command,
        control_s,
        newest.track_s,
        tuple(earlier),
        sum(one.dropped for one in heard),
    )

"""The loop of visual servoing: observe, track, control, act."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo.arm import Arm, JointState
from servoid.servo.controller import Command, Controller
from servoid.servo.keeping.safety import Reason
from servoid.servo.perception import Busy, Perception, TrackedInstant, TrackingInTurn
from servoid.source import Instant, Source
from servoid.track import Estimate, Follower

_WAITED = 3.5  # periods of an arm, during which it moved on without a command
_ANSWERS_S = 0.5  # within which a tracker returns, also one that searches
_GIVE_UP_S = 0.5  # of commands that fail in a row, after which an arm cannot be braked

Goal = Callable[[float], Pose | None]


@dataclass(frozen=True, eq=False)
class Tick:
    """One control period: inputs, command, and computing times.

    `instant` and `estimate` are set if the loop received an observation in this period; of several,
    they are the newest, and `earlier` contains the others. `control_s` is the wall-clock time of
    the control law, `track_s` that of the tracker for the newest. `dropped` counts the observations
    that arrived and were never tracked. `busy_s` is for how long the tracker, in a thread of its
    own, has been at an observation by now.
    """

    state: JointState
    instant: Instant | None
    estimate: Estimate | None
    command: Command
    control_s: float
    track_s: float
    earlier: tuple[TrackedInstant, ...] = ()
    dropped: int = 0
    busy_s: float = 0.0


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

    Where the arm moved on for more than 3.5 of its periods while it waited for the tracker, the
    command is `LATE`. A hand that is held while the tracker has not answered for 0.5 s is held as
    `UNANSWERED`, in place of `NO_IMAGES`.

    Raises:
        ServoidError: tracking has failed.

    """
    busy = perception if isinstance(perception, Busy) else None
    while True:
        state = arm.state()
        tracked = perception.tracked()
        waited_s = 0.0
        if tracked:
            asked_s, state = state.time_s, arm.state()  # a real arm moved on meanwhile
            waited_s = state.time_s - asked_s
        began = time.perf_counter()
        for one in tracked:
            controller.see(one.instant, one.estimate)
        command = controller.command(state, goal(state.time_s))
        control_s = time.perf_counter() - began
        arm.command(command.velocities)
        if waited_s > _WAITED * arm.period_s:
            command = replace(command, limiting=command.limiting | {Reason.LATE})
        busy_s = 0.0 if busy is None else busy.busy_s
        if command.holding and busy_s > _ANSWERS_S:
            holding = command.holding - {Reason.NO_IMAGES} | {Reason.UNANSWERED}
            command = replace(command, holding=holding)
        yield replace(_tick(state, tracked, command, control_s), busy_s=busy_s)


def halt(arm: Arm, controller: Controller) -> Iterator[Command]:
    """Bring hand and cameras to rest within their limits; each command is one control period.

    An arm that its own driver has stopped gets a single command of zero speeds.
    """
    while True:
        command = _braking(arm, controller)
        arm.command(command.velocities)
        yield command
        if not command.velocities.any():
            return


@contextmanager
def brought_to_rest(
    arm: Arm, controller: Controller, watch: Callable[[Command], None] = lambda _: None
) -> Iterator[None]:
    """Halt the arm when the block ends, also by an error or an interrupt.

    `watch` is called with each braking command. Whatever is raised meanwhile, by `watch`, by the
    arm or by a second interrupt, is raised once the arm is at rest. Without a joint state it brakes
    along the last command.

    Raises:
        ServoError: no command reaches the arm any more; it may still move.

    """
    try:
        yield
    except BaseException:
        _bring_to_rest(arm, controller, watch)
        raise
    raised = _bring_to_rest(arm, controller, watch)
    if raised:
        raise raised[0]


def _bring_to_rest(
    arm: Arm, controller: Controller, watch: Callable[[Command], None]
) -> list[BaseException]:
    """Brake an arm whatever is raised meanwhile, and return that."""
    raised: list[BaseException] = []
    most = max(1, round(_GIVE_UP_S / arm.period_s))
    failed = 0
    while failed < most:
        velocities = None
        try:
            if failed:
                time.sleep(arm.period_s)
            command = _braking_anyway(arm, controller, raised)
            arm.command(command.velocities)
            velocities, failed = command.velocities, 0
            watch(command)
        except BaseException as error:
            raised.append(error)
        if velocities is None:
            failed += 1
        elif not velocities.any():
            return raised
    raise ServoError(
        f"the arm could not be brought to rest: {most} commands in a row failed; it may still move "
        "at the last commanded speeds, so stop it at the arm itself"
    ) from raised[-1]


def _braking(arm: Arm, controller: Controller) -> Command:
    """Return the next command of an arm that is brought to rest."""
    state = arm.state()
    command = controller.rest(state)
    if not state.stopped:
        return command
    # After a reset, the arm must not resume the last command.
    return replace(command, velocities=np.zeros_like(command.velocities))


def _braking_anyway(arm: Arm, controller: Controller, raised: list[BaseException]) -> Command:
    """Return that command without the arm's state or geometry if they fail; note how they did."""
    try:
        return _braking(arm, controller)
    except Exception as error:
        raised.append(error)
        return controller.rest(None)


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

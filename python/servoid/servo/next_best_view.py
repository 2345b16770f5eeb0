"""Looking around: visits viewpoints around an object, each chosen by what is still unseen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Body, change_between
from servoid.errors import ServoError
from servoid.pose import Floats, Pose, exact, looking
from servoid.servo.arm import Arm, JointState
from servoid.servo.controller import Command, Controller
from servoid.servo.keeping.safety import Reason
from servoid.servo.law.reach import reached
from servoid.servo.settings import LookSettings
from servoid.servo.surface import Surface
from servoid.source import Instant, Source

_ACROSS, _UP, _DISTANCES = 9, 7, 4  # numbers of candidate viewpoints
_ENDING = frozenset({Reason.STALE, Reason.DISOBEYED})  # faults of the arm that end a visit
_LOWEST, _HIGHEST = -0.6, 1.2  # rad: elevations of viewpoints above the horizon


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A viewpoint of the object.

    `world_from_hand` is the hand's pose, `positions` (N,) the joint positions, and `gain` the share
    of the object's surface that is newly visible.
    """

    world_from_hand: Pose
    positions: Floats
    gain: float


@dataclass(frozen=True, eq=False)
class VisitStep:
    """One control period of a visit.

    `instant` is the observation from the viewpoint, in the last step. `late` is true if the hand
    did not arrive in time, and the observation is taken from where it is.
    """

    command: Command
    instant: Instant | None
    late: bool


def next_viewpoint(
    arm: Arm,
    body: Body,
    looks: Sequence[Instant],
    settings: LookSettings,
    positions: Floats,
) -> Viewpoint | None:
    """Return the viewpoint that shows most of the unseen surface; None if little is left.

    Only viewpoints that the arm can reach from its `positions` (N,) are considered.
    """
    place = np.array(body.world_from_object.translation)
    best: Viewpoint | None = None
    for way, gain in _gains(body, looks, settings):
        if gain < settings.least_gain or (best is not None and gain <= best.gain):
            continue
        # The nearest reachable viewpoint is taken: a farther one shows hardly more.
        for distance in np.linspace(settings.nearest, settings.farthest, _DISTANCES):
            goal = looking(place + distance * way, place)
            joints = reached(arm, goal, positions)
            if joints is not None:
                best = Viewpoint(goal, joints, gain)
                break
    return best


def greatest_gain(body: Body, looks: Sequence[Instant], settings: LookSettings) -> float:
    """Return the largest share of the surface that a viewpoint newly shows, reachable or not."""
    return max((gain for _, gain in _gains(body, looks, settings)), default=0.0)


def _gains(
    body: Body, looks: Sequence[Instant], settings: LookSettings
) -> Iterator[tuple[Floats, float]]:
    """Yield the directions of viewpoints, and the share of the surface that each newly shows."""
    place = np.array(body.world_from_object.translation)
    first = np.mean([pose.translation for pose in looks[0].world_from_camera], axis=0)
    surface = Surface(body)
    seen = np.zeros(len(surface), np.bool_)
    for look in looks:
        for pose in look.world_from_camera:
            seen |= surface.seen_from(np.array(pose.translation))
    for way in _cap(first - place, settings.widest_deg):
        # The visible surface hardly depends on the distance, so one is tried.
        yield way, float((surface.seen_from(place + settings.nearest * way) & ~seen).mean())


def visit(
    arm: Arm,
    source: Source,
    controller: Controller,
    goal: tuple[Pose, Floats],
    settings: LookSettings,
) -> Iterator[VisitStep]:
    """Move the hand to a pose in the world, the cameras on a point (3,), and wait for an image.

    Each step is one control period; the last one has the observation, None if it took too long.
    The hand may still move slowly at the end: `halt` brings it to rest.

    Raises:
        ServoError: the arm's own driver has stopped it, its states stopped, or it did not obey.

    """
    world_from_goal, point = goal
    start_s, arrived_s, late = arm.state().time_s, None, False
    while True:
        state = arm.state()
        check_runs(state, "before it reached the next viewpoint")
        # On the way no images are requested, so a simulation does not render them.
        instant = None if arrived_s is None else source.newest()
        off = change_between(arm.world_from_hand(state.positions), world_from_goal)
        jacobian = np.asarray(arm.jacobian(state.positions), np.float64)
        twist = exact.product(jacobian, np.asarray(state.velocities, np.float64))
        still = bool(np.abs(twist).max() < settings.still)
        near = exact.norm(off[:3]) < settings.near and exact.norm(off[3:]) < settings.near
        over = state.time_s - start_s > settings.patience_s
        if arrived_s is None and ((near and still) or over):
            arrived_s, late = state.time_s, not (near and still)
        command = controller.go_to(state, world_from_goal, point)
        for reason in command.holding & _ENDING:
            raise ServoError(f"on the way to the next viewpoint, {reason.value}")
        arm.command(command.velocities)
        fresh = arrived_s is not None and instant is not None and instant.time_s > arrived_s
        yield VisitStep(command, instant if fresh else None, late)
        if fresh or state.time_s - start_s > 2.0 * settings.patience_s:
            return


def check_runs(state: JointState, when: str) -> None:
    """Check that an arm's own driver has not stopped it; `when` ends a sentence on what it did.

    Raises:
        ServoError: it has.

    """
    if state.stopped:
        raise ServoError(
            f"the arm's own driver has stopped it {when} (a protective stop), as after a "
            "collision, or where its motors could not hold it; remove the cause, and reset the arm"
        )


def _cap(toward: Floats, widest_deg: float) -> Iterator[Floats]:
    """Yield unit directions from an object near the one from which it was first seen."""
    length = exact.norm(toward)
    azimuth, rise = exact.arctan2(toward[1], toward[0]), exact.arcsin(toward[2] / length)
    widest = np.radians(widest_deg)
    for across in np.linspace(-widest, widest, _ACROSS):
        for up in np.linspace(-widest, widest, _UP):
            if exact.hypot(across, up) > 1.05 * widest or not _LOWEST < rise + up < _HIGHEST:
                continue
            high, around = rise + up, azimuth + across
            flat = exact.cos(high)
            yield np.array([flat * exact.cos(around), flat * exact.sin(around), exact.sin(high)])

"""A servo run in a simulated world: explore an object, model it, and follow it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from servoid import model
from servoid.errors import ServoError
from servoid.output import make_folder
from servoid.pose import Floats, Pose, exact
from servoid.servo import (
    Command,
    Controller,
    Exploration,
    Goal,
    JointLaw,
    Masks,
    Seen,
    ServoLog,
    ServoRow,
    Tick,
    awaited,
    brought_to_rest,
    change_between,
    explore,
    off_center,
    servo,
    visit,
)
from servoid.sim.trial.marking import marker
from servoid.sim.trial.settings import TrialSettings, check_ages, check_events
from servoid.sim.trial.truth import Truth, true_goal
from servoid.sim.world import Path as ObjectPath
from servoid.sim.world import World
from servoid.source import Instant
from servoid.track import Estimate, Follower, Rememberer
from servoid.words import counted

LOOKS = "look"
"""The folder of the images from exploring, in the folder of a run."""

_TRACKING = "tracking"  # a tracker's status
_SPARE = 60  # observations after exploring in which the tracker may miss the object


@dataclass(frozen=True, eq=False)
class TrialStep:
    """The progress of a run: its stage, the finished share of the stage, and more.

    `row` and the unfinished `trial` are set while servoing, `instant` if an observation arrived.
    """

    stage: str
    share: float
    time_s: float
    instant: Instant | None = None
    command: Command | None = None
    estimate: Estimate | None = None
    row: ServoRow | None = None
    trial: "ServoTrial | None" = None


@dataclass(frozen=True, eq=False)
class ServoTrial:
    """The result of a run: the explored object, its tracker, and the log of servoing.

    `truth` returns the true pose of the body; `notes` are those on what the run was given.
    """

    settings: TrialSettings
    world: World
    exploration: Exploration
    tracker: Follower
    log: ServoLog
    truth: Truth
    notes: tuple[str, ...] = ()

    @property
    def appearance(self) -> bytes | None:
        """Return the appearance of the object, None if the tracker has none."""
        return self.tracker.appearance() if isinstance(self.tracker, Rememberer) else None


TrialCallback = Callable[[TrialStep], None]


def run_servo_trial(
    settings: TrialSettings,
    folder: str | Path,
    *,
    path: ObjectPath | None = None,
    notes: Sequence[str] = (),
    prepared: Callable[[World], None] | None = None,
    watch: TrialCallback | None = None,
) -> ServoTrial:
    """Explore the object of a simulated world, model it, and servo to it for the set duration.

    The object rests until servoing begins. It is marked in the first image, as a person would do
    it; nothing else is known of it. The observations are written to `folder`. `path` replaces the
    one in the settings, and `notes` are those on it; `prepared` is called with the world before
    anything moves.

    Raises:
        SimError, ServoError: the settings are not valid, a fault begins after the end, images come
            too seldom or too late, or the arm has stopped by itself.
        ModelError, TargetError: the object cannot be modelled from the images.
        DoubtError: its mark may mean several objects.

    """
    check_events(settings)
    check_ages(settings)
    world = World(settings.world, path=path)
    mark = marker(world, settings.run)
    make_folder(Path(folder), parents=True)
    if prepared is not None:
        prepared(world)
    report = watch or (lambda _: None)
    first = world.world_from_hand_at(0.0).inverse() @ world.world_from_object_at(0.0)
    exploration, goal = _explored(world, settings, Path(folder) / LOOKS, mark, report)
    # Observations on the way do not predict the motion from now on.
    controller = Controller(world.arm, settings.servo)
    tracker = _start_tracker(world, exploration, settings, controller)
    true = world.world_from_object_at(world.time_s)
    truth = Truth(world, true.inverse() @ exploration.body.world_from_object)
    log = ServoLog.of(world.arm)
    log.true_goal = true_goal(world, exploration.body, goal, first)
    trial = ServoTrial(settings, world, exploration, tracker, log, truth, tuple(notes))
    _follow(trial, controller, lambda _: goal, report)
    return trial


def _explored(
    world: World,
    settings: TrialSettings,
    folder: Path,
    mark: Callable[[Instant], Masks],
    report: TrialCallback,
) -> tuple[Exploration, Pose]:
    """Explore the object, and move the hand to the start of servoing; return also its goal.

    Raises:
        As for `run_servo_trial`.

    """

    def see(stage: str, share: float, instant: Instant | None, command: Command | None) -> None:
        report(TrialStep(stage, share, world.time_s, instant, command))

    controller = _guide(world, settings)
    exploration = explore(
        world.arm,
        world.source,
        controller,
        mark,
        folder=folder,
        settings=settings.servo.look,
        request=model.Request(
            max_ellipsoids=settings.run.max_ellipsoids,
            seed=settings.track.seed,
            trust_calibration=settings.run.trust_calibration,
        ),
        watch=see,
    )
    goal = _goal(settings, exploration)
    if any(settings.run.start_offset) or any(settings.run.start_turn_deg):
        _take_place(world, controller, _start(settings, exploration, goal), settings, see, folder)
    return exploration, goal


def _guide(world: World, settings: TrialSettings) -> Controller:
    """Return the controller that moves the hand to viewpoints.

    The paper does not explore, and with its first joint at 0 few viewpoints are reachable.
    """
    joints = replace(settings.servo.joints, law=JointLaw.QP)
    return Controller(world.arm, replace(settings.servo, joints=joints))


def _follow(trial: ServoTrial, controller: Controller, goal: Goal, report: TrialCallback) -> None:
    """Servo for the seconds of the run, keep the log, and bring the arm to rest."""
    world, seconds = trial.world, trial.settings.run.seconds
    world.start_path()

    def stopping(command: Command) -> None:
        report(TrialStep("stopping", 1.0, world.time_s, None, command))

    with brought_to_rest(world.arm, controller, stopping):
        for tick in servo(world.arm, world.source, trial.tracker, controller, goal):
            _pass_status(world, tick.estimate)
            row = _row(trial, tick, goal(tick.state.time_s))
            trial.log.add(row)
            since = tick.state.time_s - trial.log.start_s
            observed = (tick.state.time_s, tick.instant, tick.command, tick.estimate)
            report(TrialStep("servoing", min(1.0, since / seconds), *observed, row, trial))
            if since >= seconds:
                break


def _row(trial: ServoTrial, tick: Tick, goal_from_object: Pose | None) -> ServoRow:
    """Return the row of a control period, with its ground truth."""
    world, time_s = trial.world, tick.state.time_s
    body = tick.command.world_from_object
    truth = trial.truth.at(time_s, body)
    hand, believed = world.world_from_hand_at(time_s), world.arm.world_from_hand
    return ServoRow(
        tick=tick,
        world_from_hand=hand,
        world_from_goal=None if goal_from_object is None else truth @ goal_from_object.inverse(),
        truth=truth,
        seen=None if tick.instant is None else _seen(trial, tick.instant, tick.estimate),
        hand_from_object=hand.inverse() @ world.world_from_object_at(time_s),
        hand_from_body=None if body is None else believed(tick.state.positions).inverse() @ body,
    )


def _seen(trial: ServoTrial, instant: Instant, estimate: Estimate | None) -> Seen:
    """Return the newest estimate with its ground truth."""
    believed = None if estimate is None else estimate.world_from_object
    there = trial.truth.at(trial.world.true_time_s(), believed)
    cameras, poses = zip(*trial.world.true_views(), strict=True)
    return Seen(instant, estimate, there, off_center(cameras, poses, np.array(there.translation)))


def _pass_status(world: World, estimate: Estimate | None) -> None:
    """Pass the tracker's status to the world, which simulates its computing time."""
    if estimate is not None:
        world.source.tracking = estimate.status == _TRACKING


def _goal(settings: TrialSettings, exploration: Exploration) -> Pose:
    """Return goal_from_object: the desired position, with the first observed rotation."""
    hand_from_object = exploration.world_from_hand.inverse() @ exploration.body.world_from_object
    return Pose.from_parts(settings.run.goal, hand_from_object.quaternion)


def _start(settings: TrialSettings, exploration: Exploration, goal: Pose) -> tuple[Pose, Floats]:
    """Return the hand's start pose relative to its goal, and the object's middle to fixate."""
    run = settings.run
    turn = Pose.exp([0.0, 0.0, 0.0, *np.radians(run.start_turn_deg)])
    goal_from_start = Pose.from_parts(run.start_offset, turn.quaternion)
    world_from_body = exploration.body.world_from_object
    return world_from_body @ goal.inverse() @ goal_from_start, np.array(world_from_body.translation)


def _take_place(
    world: World,
    controller: Controller,
    start: tuple[Pose, Floats],
    settings: TrialSettings,
    see: Callable[[str, float, Instant | None, Command | None], None],
    looks: Path,
) -> None:
    """Move the hand to the start pose of the run; the capture of all looks is in `looks`.

    Raises:
        ServoError: the arm does not reach it.

    """
    look = settings.servo.look
    with brought_to_rest(
        world.arm, controller, lambda command: see("taking place", 1.0, None, command)
    ):
        for step in visit(world.arm, world.source, controller, start, look):
            see("taking place", 0.0, None, step.command)
    hand = world.arm.world_from_hand(world.arm.state().positions)
    off = change_between(hand, start[0])
    shift, turned = exact.norm(off[:3]), exact.norm(off[3:])
    if max(shift, turned) > look.near:
        run = settings.run
        raise ServoError(
            f"the hand cannot start {_listed(run.start_offset)} m and "
            f"{_listed(run.start_turn_deg)} degrees off its goal: it stays {shift:.3f} m and "
            f"{np.degrees(turned):.1f} degrees away from there, at a limit of the arm or of its "
            f"workspace; choose smaller values; the images so far are the capture {looks}"
        )


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _start_tracker(
    world: World, exploration: Exploration, settings: TrialSettings, controller: Controller
) -> Follower:
    """Return a tracker of the object that sees it now, and pass its estimates to the controller.

    Raises:
        ServoError: the object is not found again after looking around, or the arm has stopped.

    """
    track = settings.track
    tracker = track.method.maker(world.cameras, exploration.body, track.options())
    # Unobservable rotations stay as they were when the object was modelled.
    controller.see(None, exploration.start_tracker(tracker))
    needed = settings.servo.safety.resume_after + 1
    found = 0
    for _ in range(needed + _SPARE):
        instant = awaited(world.arm, world.source)
        estimate = tracker.step(instant.time_s, instant.world_from_camera, instant.images)
        controller.see(instant, estimate)
        _pass_status(world, estimate)
        found = found + 1 if estimate.located else 0
        if found == needed:
            return tracker
    raise ServoError(
        f"the tracker did not find the object in {counted(needed, 'image')} in a row, of the "
        f"{needed + _SPARE} after exploring; use "
        "fewer viewpoints (servo.look.count), or choose an object with more texture"
    )

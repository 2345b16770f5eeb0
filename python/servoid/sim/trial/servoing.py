"""A servo run in a simulated world: meet an object, model it, and follow it with hand and eyes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from servoid import model
from servoid.errors import ServoError
from servoid.output import make_folder
from servoid.pose import Pose, exact
from servoid.servo import (
    Command,
    Controller,
    Goal,
    JointLaw,
    Seen,
    ServoLog,
    ServoRow,
    Tick,
    brought_to_rest,
    off_center,
    servo,
    visit,
)
from servoid.servo.arm import Floats
from servoid.servo.exploration import Exploration, Masks, awaited, explore
from servoid.servo.law.moving import change_between
from servoid.sim.trial.marking import marker
from servoid.sim.trial.settings import TrialSettings
from servoid.sim.trial.truth import Truth, wish
from servoid.sim.world import Path as ObjectPath
from servoid.sim.world import World
from servoid.source import Instant
from servoid.track import Estimate, Follower, Rememberer
from servoid.words import counted

_LOOKS = "look"  # folder of what was seen while looking around
_TRACKING = "tracking"  # a tracker's status
_SPARE = 60  # observations after the looks in which the tracker may fail to see the object


@dataclass(frozen=True, eq=False)
class TrialStep:
    """What a run does at one moment: its stage, the share of the stage that is done, and more.

    `row` and `trial`, as far as it has come, are there while servoing, `instant` when an
    observation arrived.
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
    """What came of a run: the object as it was met, its tracker, and the log of servoing.

    `truth` says where the body was in truth.
    """

    settings: TrialSettings
    world: World
    exploration: Exploration
    tracker: Follower
    log: ServoLog
    truth: Truth

    @property
    def appearance(self) -> bytes | None:
        """Return what the object looks like, None if the tracker does not say."""
        return self.tracker.appearance() if isinstance(self.tracker, Rememberer) else None


Watch = Callable[[TrialStep], None]


def run_servo_trial(
    settings: TrialSettings,
    folder: str | Path,
    *,
    path: ObjectPath | None = None,
    prepared: Callable[[World], None] | None = None,
    watch: Watch | None = None,
) -> ServoTrial:
    """Meet the object of a simulated world, model it, and servo to it for the seconds asked for.

    The object rests until servoing begins. It is marked in the first image, as a person would do
    it; nothing else is known of it. `folder` gets what was looked at. `path` takes the place of the
    one in the settings; `prepared` hears of the world before anything moves.

    Raises:
        SimError, ServoError: the settings cannot be.
        ModelError, TargetError: the object cannot be modelled from what the hand can see.
        DoubtError: where it is marked may mean several objects.

    """
    world = World(settings.world, path=path)
    mark = marker(world, settings.run)
    make_folder(Path(folder), parents=True)
    if prepared is not None:
        prepared(world)
    tell = watch or (lambda _: None)
    first = world.world_from_hand_at(0.0).inverse() @ world.world_from_object_at(0.0)
    exploration, goal = _met(world, settings, Path(folder) / _LOOKS, mark, tell)
    # What was seen on the way says nothing of how the object moves from now on.
    controller = Controller(world.arm, settings.servo)
    tracker = _start_tracker(world, exploration, settings, controller)
    true = world.world_from_object_at(world.time_s)
    truth = Truth(world, true.inverse() @ exploration.body.world_from_object)
    log = ServoLog.of(world.arm)
    log.wish = wish(world, exploration.body, goal, first)
    trial = ServoTrial(settings, world, exploration, tracker, log, truth)
    _follow(trial, controller, lambda _: goal, tell)
    return trial


def _met(
    world: World,
    settings: TrialSettings,
    folder: Path,
    mark: Callable[[Instant], Masks],
    tell: Watch,
) -> tuple[Exploration, Pose]:
    """Meet the object, and bring the hand to where servoing starts; return also what its goal is.

    Raises:
        As for `run_servo_trial`.

    """

    def see(stage: str, share: float, instant: Instant | None, command: Command | None) -> None:
        tell(TrialStep(stage, share, world.time_s, instant, command))

    controller = _guide(world, settings)
    exploration = explore(
        world.arm,
        world.source,
        controller,
        mark,
        folder=folder,
        settings=settings.servo.look,
        request=model.Request(max_ellipsoids=settings.run.max_ellipsoids, seed=settings.track.seed),
        watch=see,
    )
    goal = _goal(settings, exploration)
    if any(settings.run.start_offset) or any(settings.run.start_turn_deg):
        _take_place(world, controller, _start(settings, exploration, goal), settings, see)
    return exploration, goal


def _guide(world: World, settings: TrialSettings) -> Controller:
    """Make what leads the hand to places to look from.

    The paper does not look around, and with its first joint at 0 few of these places are reached.
    """
    joints = replace(settings.servo.joints, law=JointLaw.QP)
    return Controller(world.arm, replace(settings.servo, joints=joints))


def _follow(trial: ServoTrial, controller: Controller, goal: Goal, tell: Watch) -> None:
    """Servo for the seconds of the run, keep the log, and bring the arm to rest."""
    world, seconds = trial.world, trial.settings.run.seconds
    world.start_path()

    def stopping(command: Command) -> None:
        tell(TrialStep("stopping", 1.0, world.time_s, None, command))

    with brought_to_rest(world.arm, controller, stopping):
        for tick in servo(world.arm, world.source, trial.tracker, controller, goal):
            _tell_status(world, tick.estimate)
            row = _row(trial, tick, goal(tick.state.time_s))
            trial.log.add(row)
            since = tick.state.time_s - trial.log.start_s
            told = (tick.state.time_s, tick.instant, tick.command, tick.estimate)
            tell(TrialStep("servoing", min(1.0, since / seconds), *told, row, trial))
            if since >= seconds:
                break


def _row(trial: ServoTrial, tick: Tick, goal_from_object: Pose | None) -> ServoRow:
    """Join what was known in a control period with what was true."""
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
    """Join what the tracker said of the newest observation with what was true."""
    believed = None if estimate is None else estimate.world_from_object
    there = trial.truth.at(trial.world.true_time_s(), believed)
    cameras, poses = zip(*trial.world.true_views(), strict=True)
    return Seen(instant, estimate, there, off_center(cameras, poses, np.array(there.translation)))


def _tell_status(world: World, estimate: Estimate | None) -> None:
    """Let the world know how long the tracker takes from now on."""
    if estimate is not None:
        world.source.tracking = estimate.status == _TRACKING


def _goal(settings: TrialSettings, exploration: Exploration) -> Pose:
    """Return goal_from_object: the object where it is wanted, turned as the hand first saw it."""
    hand_from_object = exploration.world_from_hand.inverse() @ exploration.body.world_from_object
    return Pose.from_parts(settings.run.goal, hand_from_object.quaternion)


def _start(settings: TrialSettings, exploration: Exploration, goal: Pose) -> tuple[Pose, Floats]:
    """Return where the hand starts off its goal, and the object's middle to look at."""
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
) -> None:
    """Bring the hand to where the run wants it to start.

    Raises:
        ServoError: the arm does not get there.

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
        asked = settings.run
        raise ServoError(
            f"the hand cannot start {_listed(asked.start_offset)} m and "
            f"{_listed(asked.start_turn_deg)} degrees off its goal: it stays {shift:.3f} m and "
            f"{np.degrees(turned):.1f} degrees away from there, since the arm does not reach that "
            "far or may not; choose smaller values"
        )


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _start_tracker(
    world: World, exploration: Exploration, settings: TrialSettings, controller: Controller
) -> Follower:
    """Make a tracker that knows the object and sees it now, and let the controller know, too.

    Raises:
        ServoError: the object is not found again after looking around.

    """
    asked = settings.track
    tracker = asked.method.maker(world.cameras, exploration.body, asked.options())
    # Turns that images leave open stay as they were when the object was modelled.
    controller.see(None, exploration.teach(tracker))
    needed = settings.servo.safety.resume_after + 1
    found = 0
    for _ in range(needed + _SPARE):
        instant = awaited(world.arm, world.source)
        estimate = tracker.step(instant.time_s, instant.world_from_camera, instant.images)
        controller.see(instant, estimate)
        _tell_status(world, estimate)
        found = found + 1 if estimate.located else 0
        if found == needed:
            return tracker
    raise ServoError(
        f"the tracker did not see the object in {counted(needed, 'image')} in a row, of the "
        f"{needed + _SPARE} after looking around; look "
        "from fewer places (servo.look.count), or choose an object with more pattern"
    )

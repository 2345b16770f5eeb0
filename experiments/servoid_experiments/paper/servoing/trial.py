"""One servo run to the paper's moving object, with a known object."""

import math

import msgspec
import numpy as np

from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.servo import Controller, Tick, servo
from servoid.servo.exploration import first_look
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings
from servoid.sim.world.settings import PhysicsSettings
from servoid_experiments.paper.eye_pair import true_body
from servoid_experiments.paper.servoing.followed import Followed, Track, followed
from servoid_experiments.paper.servoing.method import (
    Method,
    Reading,
    TrackerKind,
    make_follower,
    servo_settings,
)
from servoid_experiments.paper.servoing.settings import (
    Constants,
    Omega,
    Periods,
    Place,
    Settle,
    Triple,
)

_ELLIPSOID = "ellipsoid"
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


class ServoingCase(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A run: `name` is its group in the study, and `seed` sets noise and search."""

    name: str
    seed: int
    omega: Omega
    settle_s: Settle
    periods: Periods
    object: str = _ELLIPSOID
    method: Method = Method()
    constants: Constants = Constants()


class ServoingRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The results of a run.

    `seen_turn_deg` is the RMS error of the recognised rotation, `held_share` the share of the time
    in which the hand was held, and `scored` the number of poses scored per image.
    """

    followed: Followed
    seen_turn_deg: float
    held_share: float
    scored: float


class _Course:
    """Records a run from the start of the object's path, in M0, the object's frame at its start.

    `ticks` are seconds and the hand's position relative to its goal at the start; `looks` are
    seconds, the true and the recognised position, and the rotation error in degrees.
    """

    def __init__(self, world: World, follower: Reading, goal_from_object: Pose) -> None:
        self._world, self._follower = world, follower
        self._start_from_world = world.world_from_object_at(0.0).inverse()
        self._start_from_goal = goal_from_object.inverse()
        self.ticks: list[tuple[float, ...]] = []
        self.looks: list[tuple[float, ...]] = []
        self.held = 0
        self.scored = 0

    def add(self, tick: Tick, began_s: float) -> None:
        """Record the measurements of a control period."""
        world_from_hand = self._world.arm.world_from_hand(tick.state.positions)
        place = (self._start_from_world @ world_from_hand).translation
        off = np.subtract(place, self._start_from_goal.translation)
        self.ticks.append((tick.state.time_s - began_s, *off))
        self.held += bool(tick.command.holding)
        if tick.instant is None or tick.estimate is None:
            return
        truth = self._world.world_from_object_at(tick.instant.time_s)
        seen = self._follower.world_from_seen
        missed = (truth.inverse() @ seen).log()[3:]
        self.scored += tick.estimate.evaluations
        self.looks.append(
            (
                tick.instant.time_s - began_s,
                *(self._start_from_world @ truth).translation,
                *(self._start_from_world @ seen).translation,
                math.degrees(float(np.linalg.norm(missed))),
            )
        )


def run_servoing(case: ServoingCase) -> ServoingRow:
    """Servo to the object, and measure it.

    Raises:
        ServoError: no image arrives.
        SimError: a constant is invalid.

    """
    world = World(world_settings(case))
    return _row(case, _followed(case, world))


def world_settings(case: ServoingCase) -> WorldSettings:
    """Return the world settings of a run."""
    given = case.constants
    scene, eyes, arm = given.scene, given.eyes, given.arm
    seconds, ellipsoid = 2.0 * math.pi / case.omega, case.object == _ELLIPSOID
    return WorldSettings(
        ideal=True,
        arm=ArmSettings(
            links=arm.links,
            lag_s=arm.lag_s,
            half_baseline=eyes.half_baseline,
            eyes_on_object=eyes.verging,
            world_from_hand=scene.world_from_hand,
        ),
        object=ObjectSettings(
            name=case.object,
            radii=scene.radii if ellipsoid else None,
            hand_from_object=(*_UPRIGHT, *start_place(given)),
            path=f"sine:{scene.amplitude!r}@{seconds!r}s",
        ),
        cameras=CameraSettings(
            size_px=eyes.size_px,
            focal_px=0.5 * eyes.size_px[0] / math.tan(math.radians(0.5 * eyes.sight_deg)),
            rate_hz=eyes.rate_hz,
            latency_s=eyes.latency_s,
            noise=eyes.noise,
            moments=1,
            samples=1,
        ),
        physics=PhysicsSettings(period_s=arm.period_s),
        background=scene.background,
        seed=case.seed,
        threads=1,
    )


def start_place(given: Constants) -> Triple:
    """Return where the object starts in the hand's frame, in metres."""
    scene = given.scene
    if scene.place is Place.TEXT:
        return scene.goal
    world_from_hand = Pose.from_parts(scene.world_from_hand[4:], scene.world_from_hand[:4])
    x, y, z = world_from_hand.inverse().transform(np.array([scene.printed_place]))[0]
    return (float(x), float(y), float(z))


def _followed(case: ServoingCase, world: World) -> _Course:
    """Start the tracker at the modelled pose, and servo for the measured time."""
    given = case.constants
    radii = given.scene.radii if case.object == _ELLIPSOID else None
    body = true_body(case.object, Pose.identity(), radii)
    follower = make_follower(world, body, case.method, given.search, case.seed)
    controller = Controller(world.arm, servo_settings(case.method, given))
    first = first_look(world.arm, world.source)
    there = world.world_from_object_at(first.time_s)
    follower.start(first.time_s, first.world_from_camera, first.images, there)
    goal_from_object = Pose.from_parts(given.scene.goal, _UPRIGHT)
    course, began_s = _Course(world, follower, goal_from_object), math.inf
    begins_s = world.time_s + given.scene.rest_s
    # The last images of the measured time arrive after it has ended.
    arrives_s = given.eyes.latency_s + 1.0 / given.eyes.rate_hz
    lasts_s = case.settle_s + case.periods * 2.0 * math.pi / case.omega + arrives_s
    for tick in servo(world.arm, world.source, follower, controller, lambda _: goal_from_object):
        if math.isinf(began_s) and world.time_s >= begins_s:
            world.start_path()
            began_s = world.time_s
        if tick.state.time_s >= began_s:
            course.add(tick, began_s)
        if tick.state.time_s - began_s > lasts_s:
            break
    return course


def _row(case: ServoingCase, course: _Course) -> ServoingRow:
    """Measure a run."""
    ticks, looks = np.array(course.ticks), np.array(course.looks)
    looks = looks[(looks[:, 0] >= 0.0) & (looks[:, 0] <= ticks[-1, 0])]
    seconds = looks[:, 0]
    times = 1 if case.method.tracker is TrackerKind.SERVOID else case.constants.search.generations
    hand = np.stack([np.interp(seconds, ticks[:, 0], column) for column in ticks[:, 1:].T], axis=1)
    track = Track(times=seconds, target=looks[:, 1:4], seen=looks[:, 4:7], hand=hand)
    return ServoingRow(
        followed=followed(track, case.omega, case.settle_s, case.periods),
        seen_turn_deg=float(np.sqrt(np.mean(looks[seconds >= case.settle_s, 7] ** 2))),
        held_share=course.held / len(ticks),
        scored=course.scored * times / len(course.looks),
    )


SERVOING = Experiment("servoing", run_servoing, ServoingCase, ServoingRow)

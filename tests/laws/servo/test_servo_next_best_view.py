from collections.abc import Iterator
from dataclasses import dataclass, field
from dataclasses import replace as replaced

import numpy as np
import pytest
from msgspec.structs import replace
from scenes_looking import SETTINGS, body_at, look_at, look_from, no_better, seen_by
from servo_loop import PERIOD_S, RATE_HZ, WORLD_FROM_OBJECT

from servoid._native import change_between
from servoid.camera import Camera
from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo import Controller, LookSettings, Viewpoint, next_viewpoint, visit
from servoid.servo.exploration import _Progress, first_look
from servoid.servo.next_best_view import greatest_gain
from servoid.servo.surface import Surface
from servoid.shape import Body
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source.source import Instant

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

PLACE = np.array(WORLD_FROM_OBJECT.translation)
LATENCY_S = 0.05
NAMES = ("left", "right")


@dataclass
class Blinking:
    """A source that takes an image of nothing now and then, and delivers it later."""

    arm: SerialArm
    rate_hz: float = RATE_HZ
    cameras: tuple[Camera, ...] = ()
    taken: int = 0
    on_the_way: list[Instant] = field(default_factory=list)

    def newest(self) -> Instant | None:
        state = self.arm.state()
        if self.taken / self.rate_hz <= state.time_s:
            poses = self.arm.world_from_cameras(state.positions)
            image = np.zeros((4, 4, 3), np.uint8)
            self.on_the_way.append(Instant(self.taken, state.time_s, poses, (image, image)))
            self.taken = int(state.time_s * self.rate_hz) + 1
        arrived = [one for one in self.on_the_way if one.time_s + LATENCY_S <= state.time_s]
        self.on_the_way = [one for one in self.on_the_way if one not in arrived]
        return arrived[-1] if arrived else None


def around(body: Body, settings: LookSettings) -> Iterator[tuple[Viewpoint, list[Instant]]]:
    """Choose one viewpoint after another, each with the looks that were there before."""
    arm = SerialArm(read_arm())
    looks = [look_from(arm, arm.state().positions)]
    for _ in range(12):
        viewpoint = next_viewpoint(arm, body, looks, settings, arm.state().positions)
        if viewpoint is None:
            return
        yield viewpoint, list(looks)
        looks.append(look_at(viewpoint.world_from_hand))
    raise AssertionError("there is always more to see")


def test_a_viewpoint_is_held_by_its_joints_and_faces_the_object_from_an_allowed_distance() -> None:
    arm = SerialArm(read_arm())
    first = np.mean([pose.translation for pose in look_from(arm, arm.state().positions)
                     .world_from_camera], axis=0) - PLACE  # fmt: skip
    for viewpoint, _ in around(body_at(WORLD_FROM_OBJECT), SETTINGS):
        joints = viewpoint.positions
        assert np.all((arm.joints.lower <= joints) & (joints <= arm.joints.upper))
        off = change_between(arm.world_from_hand(joints), viewpoint.world_from_hand)
        assert np.abs(off).max() < 1e-5
        x, y, z = viewpoint.world_from_hand.inverse().transform(PLACE[None])[0]
        assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert SETTINGS.nearest - 1e-9 <= z <= SETTINGS.farthest + 1e-9
        assert viewpoint.world_from_hand.matrix()[2, 0] == pytest.approx(0.0, abs=1e-9)
        away = np.array(viewpoint.world_from_hand.translation) - PLACE
        cosine = first @ away / np.linalg.norm(first) / np.linalg.norm(away)
        assert np.degrees(np.arccos(cosine)) < 1.05 * SETTINGS.widest_deg


@pytest.mark.extended
def test_a_viewpoint_gains_what_it_says_and_later_ones_gain_less() -> None:
    body = body_at(WORLD_FROM_OBJECT)
    surface = Surface(body)
    gains = []
    for viewpoint, looks in around(body, SETTINGS):
        before = seen_by(surface, looks)
        after = seen_by(surface, [*looks, look_at(viewpoint.world_from_hand)])
        # Nearly the same is seen from a little farther away.
        assert viewpoint.gain == pytest.approx(after.mean() - before.mean(), abs=0.03)
        gains.append(viewpoint.gain)
    assert gains[0] > 0.03
    assert gains == sorted(gains, reverse=True)
    assert gains[-1] >= SETTINGS.least_gain


@pytest.mark.extended
def test_no_other_place_that_is_reached_gains_clearly_more() -> None:
    assert no_better.broken(3) == []


@pytest.mark.extended
def test_there_is_no_next_viewpoint_when_all_is_seen_or_nothing_can_be_reached() -> None:
    arm = SerialArm(read_arm())
    start = arm.state().positions
    here = look_from(arm, start)
    ways = [np.array([x, y, z]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    ball_of_looks = [
        look_at(Pose.from_parts((PLACE + 0.4 * way).tolist(), (1.0, 0.0, 0.0, 0.0))) for way in ways
    ]
    body = body_at(WORLD_FROM_OBJECT)
    assert next_viewpoint(arm, body, [here, *ball_of_looks], SETTINGS, start) is None
    assert greatest_gain(body, [here, *ball_of_looks], SETTINGS) < SETTINGS.least_gain
    far = body_at(Pose.from_parts((-6.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0)))
    assert next_viewpoint(arm, far, [here], SETTINGS, start) is None
    assert greatest_gain(far, [here], SETTINGS) > SETTINGS.least_gain


@pytest.mark.parametrize(
    ("x", "change", "why"),
    [
        (-6.0, {}, "the arm reaches no further one that shows another 2 % of the surface"),
        (None, {"least_gain": 0.9}, "no further one within 60 degrees of the first shows"),
    ],
)
def test_fewer_viewpoints_than_asked_for_are_noted_with_the_reason(
    x: float | None, change: dict[str, float], why: str
) -> None:
    arm = SerialArm(read_arm())
    settings = replace(LookSettings(), **change)
    far = Pose.from_parts((x or 0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    body = body_at(WORLD_FROM_OBJECT if x is None else far)
    start = arm.state().positions
    tour = _Progress(arm, Blinking(arm), Controller(arm), settings, lambda *_: None)
    looks = tour.around(body, look_from(arm, start), arm.world_from_hand(start))
    (note,) = tour.notes(len(looks))
    assert note.startswith(
        "the object was viewed from 1 viewpoint, of 5 at most (servo.look.count)"
    )
    assert why in note


def test_a_look_that_was_meant_to_be_the_only_one_has_no_note() -> None:
    arm = SerialArm(read_arm())
    start = arm.state().positions
    settings = LookSettings(count=1)
    tour = _Progress(arm, Blinking(arm), Controller(arm), settings, lambda *_: None)
    home = arm.world_from_hand(start)
    looks = tour.around(body_at(WORLD_FROM_OBJECT), look_from(arm, start), home)
    assert (len(looks), tour.notes(len(looks))) == (1, ())


@dataclass
class Visit:
    """What happened on the way to a viewpoint: hands and their speeds, and what came of it."""

    arm: SerialArm
    goal: Pose
    seconds: float = 0.0
    off: list[np.ndarray] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)
    fixation: list[float] = field(default_factory=list)
    commands: list[np.ndarray] = field(default_factory=list)
    instants: list[Instant | None] = field(default_factory=list)
    late: bool = False

    def go(self, source: Blinking) -> "Visit":
        arm = self.arm
        visiting = visit(arm, source, Controller(arm), (self.goal, PLACE), SETTINGS)  # type: ignore
        for step in visiting:
            state = arm.state()
            self.off.append(change_between(arm.world_from_hand(state.positions), self.goal))
            self.speeds.append(
                float(np.abs(arm.jacobian(state.positions) @ state.velocities).max())
            )
            eyes = arm.world_from_cameras(state.positions)
            seen = [pose.inverse().transform(PLACE[None])[0] for pose in eyes]
            self.fixation.append(max(float(np.arctan2(np.hypot(x, y), z)) for x, y, z in seen))
            self.commands.append(step.command.velocities)
            self.instants.append(step.instant)
            self.late = step.late
        self.seconds = arm.state().time_s
        return self


@pytest.fixture(scope="module")
def visited() -> Visit:
    viewpoint, _ = next(around(body_at(WORLD_FROM_OBJECT), SETTINGS))
    arm = SerialArm(read_arm(), PERIOD_S)
    return Visit(arm, viewpoint.world_from_hand).go(Blinking(arm))


def test_a_visit_ends_at_its_goal_and_at_rest(visited: Visit) -> None:
    assert np.linalg.norm(visited.off[0][:3]) > 0.1
    assert np.linalg.norm(visited.off[-1][:3]) < SETTINGS.near
    assert np.linalg.norm(visited.off[-1][3:]) < SETTINGS.near
    assert visited.speeds[-1] < SETTINGS.still
    assert visited.seconds < SETTINGS.patience_s and not visited.late


def test_the_observation_of_a_visit_was_taken_after_the_hand_had_arrived(visited: Visit) -> None:
    *before, last = visited.instants
    assert before == [None] * len(before) and last is not None
    place = round(last.time_s / PERIOD_S)
    assert all(np.linalg.norm(off[:3]) < SETTINGS.near for off in visited.off[place - 1 :])
    assert max(visited.speeds[place - 1 :]) < SETTINGS.still


def test_both_eyes_keep_the_point_in_sight_on_the_way(visited: Visit) -> None:
    turned = visited.fixation[round(0.6 / PERIOD_S) :]
    assert max(turned) < np.radians(2.0)
    assert turned[-1] < np.radians(0.3)


def test_a_visit_commands_no_acceleration_above_the_limits(visited: Visit) -> None:
    speeds = np.array([0.0 * visited.commands[0], *visited.commands])
    steps = np.abs(np.diff(speeds, axis=0)) / PERIOD_S
    assert np.all(steps <= visited.arm.joints.acceleration * (1.0 + 1e-9))


def test_a_visit_to_a_place_out_of_reach_ends_where_the_patience_does() -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    far = Pose.from_parts((-3.0, 0.0, 0.5), (0.5, -0.5, -0.5, 0.5))
    tried = Visit(arm, far).go(Blinking(arm))
    assert tried.seconds == pytest.approx(SETTINGS.patience_s, abs=0.3)
    assert tried.instants[-1] is not None and tried.late
    assert np.linalg.norm(tried.off[-1][:3]) > 1.0


def test_a_first_look_that_never_comes_is_an_error_and_the_arm_rests_meanwhile() -> None:
    arm = SerialArm(read_arm())
    start = arm.state().positions
    with pytest.raises(ServoError, match="no image came within 16 s; check that the cameras run"):
        first_look(arm, Blinking(arm, taken=1_000_000))  # type: ignore
    np.testing.assert_array_equal(arm.state().positions, start)


@dataclass
class Lacking(Blinking):
    """A source whose observations lack an image: of the cameras of `lost`, which take turns."""

    lost: tuple[tuple[int, ...], ...] = ((),)

    def newest(self) -> Instant | None:
        instant = super().newest()
        if instant is None:
            return None
        lost = self.lost[instant.index % len(self.lost)]
        images = tuple(None if number in lost else one for number, one in enumerate(instant.images))
        notices = tuple(f"camera {NAMES[number]}: its image was lost" for number in lost)
        return replaced(instant, images=images, notices=notices, names=NAMES)


@pytest.mark.parametrize(
    ("lost", "words"),
    [
        (
            ((1,),),
            r"camera right gave no image within 16 s, while camera left gave \d\d\d; check camera "
            r"right \(camera right: its image was lost\)",
        ),
        (((0, 1),), r"no image came within 16 s; check that the cameras run \(camera right: "),
        (
            ((0,), (1,)),
            r"none of \d+ observations within 16 s had an image of every camera: camera left gave "
            r"\d+ and camera right gave \d+; check the cameras",
        ),
    ],
)
def test_a_first_look_names_the_camera_that_gives_no_image(
    lost: tuple[tuple[int, ...], ...], words: str
) -> None:
    arm = SerialArm(read_arm())
    with pytest.raises(ServoError, match=f"^{words}"):
        first_look(arm, Lacking(arm, lost=lost))  # type: ignore


def test_a_visit_without_images_ends_without_an_observation() -> None:
    arm = SerialArm(read_arm(), PERIOD_S)
    goal = arm.world_from_hand(arm.state().positions)
    blind = Visit(arm, goal).go(Blinking(arm, taken=1_000_000))
    assert blind.instants == [None] * len(blind.instants)
    assert blind.seconds == pytest.approx(2.0 * SETTINGS.patience_s, abs=0.1)

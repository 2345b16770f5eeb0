import math

import numpy as np
import pytest
from tiers import tiered

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servoid.errors import ServoError, SimError
from servoid.pose import Pose
from servoid.servo import Arm
from servoid.sim.arm_file import read_arm
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    ObjectSettings,
    PhysicsSettings,
    World,
    WorldSettings,
)
from servoid.sim.world.arms import kinematics

CAMERAS = CameraSettings(size_px=(64, 48), samples=1, moments=1)


def make_world(**changes: object) -> World:
    given = {"background": "plain", "cameras": CAMERAS, "ideal": True, **changes}
    return World(WorldSettings(**given))


@pytest.fixture(scope="module")
def resting() -> World:
    return make_world()


def random_angles(world: World, seed: int) -> np.ndarray:
    joints = world.arm.joints
    return np.random.default_rng(seed).uniform(joints.lower, joints.upper)


def by_denavit_hartenberg(angles: np.ndarray, links: str) -> np.ndarray:
    """Return world_from_hand (4, 4), worked out from Craig's matrices alone."""
    arm = read_arm("pa10", links)
    d1, d3, d5, d7 = arm.lengths
    total = np.eye(4)
    for twist_deg, d, turn in zip(
        arm.chain.twists_deg, (d1, 0.0, d3, 0.0, d5, 0.0, d7), angles[:7], strict=True
    ):
        ca, sa = math.cos(math.radians(twist_deg)), math.sin(math.radians(twist_deg))
        ct, st = math.cos(turn), math.sin(turn)
        total = total @ np.array(
            [
                [ct, -st, 0.0, 0.0],
                [st * ca, ct * ca, -sa, -sa * d],
                [st * sa, ct * sa, ca, ca * d],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
    mount = np.eye(4)
    mount[2, 3] = 0.1
    return total @ mount


@pytest.mark.parametrize("links", ["openbionics", "jsi"])
def test_the_hand_is_where_the_denavit_hartenberg_parameters_put_it(links: str) -> None:
    world = make_world(arm=ArmSettings(links=links))
    for seed in range(5):
        angles = random_angles(world, seed)
        found = world.arm.world_from_hand(angles).matrix()
        assert np.abs(found - by_denavit_hartenberg(angles, links)).max() < 1e-12


def test_a_start_that_was_sought_before_is_that_of_the_same_arm_and_pose_to_the_bit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def starts() -> list[bytes]:
        given = ({}, {"links": "jsi"}, {"world_from_hand": (1.0, 0, 0, 0, -0.5, 0.1, 0.7)})
        arms = [make_world(arm=ArmSettings(**one)).arm for one in given]
        return [arm.state().positions.tobytes() for arm in arms]

    monkeypatch.setattr(kinematics, "_kept", {})
    sought = starts()
    monkeypatch.setattr(kinematics, "_TRIES", 0)
    assert starts() == sought
    assert len(set(sought)) == 3


@pytest.mark.parametrize("links", ["openbionics", "jsi"])
def test_the_arm_starts_with_the_hand_where_the_paper_has_it(links: str) -> None:
    world = make_world(arm=ArmSettings(links=links))
    state = world.arm.state()
    wanted = np.array([[0, 0, -1, -0.89], [1, 0, 0, 0], [0, -1, 0, 0.5], [0, 0, 0, 1]])
    assert np.abs(world.arm.world_from_hand(state.positions).matrix() - wanted).max() < 1e-5
    assert state.positions[0] == 0.0
    assert (state.positions > world.arm.joints.lower).all()
    assert (state.positions < world.arm.joints.upper).all()


def test_a_simulated_arm_is_an_arm(resting: World) -> None:
    assert isinstance(resting.arm, Arm)
    assert resting.arm.joints.hand_count == 7
    assert len(resting.arm.joints.names) == 10
    assert resting.arm.period_s == 0.008


def test_the_jacobian_says_how_the_hand_moves_when_a_joint_turns(resting: World) -> None:
    arm, step = resting.arm, 1e-6
    angles = random_angles(resting, 3)
    jacobian = arm.jacobian(angles)
    for joint in range(10):
        turn = step * np.eye(10)[joint]
        before, after = arm.world_from_hand(angles - turn), arm.world_from_hand(angles + turn)
        linear = np.subtract(after.translation, before.translation) / (2 * step)
        turned = Pose.from_parts((0, 0, 0), (after @ before.inverse()).quaternion).log()[3:]
        assert np.abs(jacobian[:3, joint] - linear).max() < 1e-8
        assert np.abs(jacobian[3:, joint] - turned / (2 * step)).max() < 1e-8
    assert (jacobian[:, 7:] == 0.0).all()


def test_eyes_turn_as_the_protocol_says(resting: World) -> None:
    arm, eyes = resting.arm, resting.arm.eyes
    assert eyes is not None
    angles = random_angles(resting, 4)
    world_from_head = arm.world_from_hand(angles) @ eyes.hand_from_head
    tilt = Pose.exp([0, 0, 0, -angles[eyes.tilt], 0, 0])
    for camera, side, pan in zip(
        arm.world_from_cameras(angles), (-1, 1), (eyes.pan_left, eyes.pan_right), strict=True
    ):
        place = Pose.from_parts((side * eyes.half_baseline, 0, 0), (1, 0, 0, 0))
        wanted = world_from_head @ tilt @ place @ Pose.exp([0, 0, 0, 0, angles[pan], 0])
        assert np.abs(camera.matrix() - wanted.matrix()).max() < 1e-12


def test_eyes_may_be_farther_from_each_other() -> None:
    world = make_world(arm=ArmSettings(half_baseline=0.2))
    eyes = world.arm.eyes
    assert eyes is not None
    assert eyes.half_baseline == 0.2
    left, right = world.arm.world_from_cameras(random_angles(world, 4))
    apart = np.linalg.norm(np.subtract(left.translation, right.translation))
    assert abs(apart - 0.4) < 1e-9


def test_slower_servos_answer_later() -> None:
    reached = []
    for lag_s in (0.01, 0.04):
        world = make_world(arm=ArmSettings(lag_s=lag_s))
        world.arm.command(np.array([0.05, *np.zeros(9)]))
        reached.append(float(world.arm.state().velocities[0]))
    assert 0.0 < reached[1] < 0.5 * reached[0]


def test_a_commanded_speed_is_reached_with_the_lag_of_the_file() -> None:
    world = make_world()
    arm = read_arm("pa10")
    wanted = np.zeros(10)
    wanted[[0, 3, 6, 7]] = 0.05, -0.05, 0.1, 0.2
    lags = np.array([arm.joints.lag_s] * 7 + [arm.eyes.lag_s] * 3)
    for period in range(1, 13):
        world.arm.command(wanted)
        share = 1.0 - np.exp(-period * world.arm.period_s / lags)
        assert np.abs(world.arm.state().velocities - share * wanted).max() < 2e-3
    assert np.abs(world.arm.state().velocities - wanted).max() < 1e-3


def test_gravity_does_not_move_an_arm_that_is_told_to_rest() -> None:
    world = make_world()
    before = world.arm.state().positions
    for _ in range(125):
        world.arm.command(np.zeros(10))
    assert np.abs(world.arm.state().positions - before).max() < 1e-6


@pytest.mark.parametrize("driven", tiered([[0, 6, 7, 8, 9], [2], [3]]))
def test_joints_keep_their_limits_whatever_is_commanded(driven: list[int]) -> None:
    world = make_world()
    joints, fastest = world.arm.joints, 0.0
    before, velocities = world.arm.state(), np.zeros(10)
    velocities[driven] = 50.0  # of joints whose links meet nothing on the way to their stops
    for _ in range(500):
        world.arm.command(velocities)
        state = world.arm.state()
        change = np.abs(state.velocities - before.velocities) / world.arm.period_s
        assert (np.abs(state.velocities) <= joints.speed * 1.001).all()
        assert (change[7:] <= joints.acceleration[7:] * 1.01).all()
        assert (state.positions <= joints.upper + 1e-3).all()
        fastest = max(fastest, float(np.abs(state.velocities / joints.speed).max()))
        before = state
    assert fastest > 0.98 and not before.stopped
    assert np.abs(before.velocities).max() < 0.05


def test_a_command_takes_one_control_period_of_the_worlds_time() -> None:
    world = make_world(physics=PhysicsSettings(step_s=0.001, period_s=0.004))
    for count in range(1, 300):
        world.arm.command(np.zeros(10))
        assert world.time_s == pytest.approx(count * 0.004, abs=1e-12)
        assert world.arm.state().time_s == world.time_s


@pytest.mark.parametrize(
    ("velocities", "words"),
    [
        (np.zeros(9), "shape (9,)"),
        (np.full(10, np.nan), "that of s1 is nan"),
        (np.ones((2, 5)), "10 finite joint speeds are needed"),
    ],
)
def test_a_command_that_is_none_is_refused_and_time_stands(
    resting: World, velocities: np.ndarray, words: str
) -> None:
    before = resting.time_s
    with pytest.raises(ServoError) as caught:
        resting.arm.command(velocities)
    assert words in str(caught.value)
    assert resting.time_s == before


def test_the_object_waits_where_the_paper_has_it(resting: World) -> None:
    hand = resting.arm.world_from_hand(resting.arm.state().positions)
    relation = hand.inverse() @ resting.world_from_object_at(0.0)
    assert relation.translation == pytest.approx((0.0, -0.09, 0.545), abs=1e-9)
    assert relation.quaternion == pytest.approx((1, 0, 0, 0), abs=1e-9)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"object": ObjectSettings(name="teapot")}, ("'teapot'", "bottle", "two_ellipsoids")),
        ({"background": "jungle"}, ("'jungle'", "cluttered", "plain")),
        ({"renderer": "oil"}, ("'oil'", "raycast", "mujoco")),
        ({"object": ObjectSettings(path="zigzag")}, ("'zigzag'", "sine:METRES@PERIOD")),
        ({"arm": ArmSettings(name="pa11")}, ("'pa11'", "pa10", "MJCF or URDF")),
        ({"arm": ArmSettings(links="short")}, ("'short'", "openbionics", "jsi")),
        ({"arm": ArmSettings(start=(0.1, 0.2))}, ("2 angles", "7 for the hand", "10")),
        ({"arm": ArmSettings(start=(0, 9.0, 0, 0, 0, 0, 0))}, ("s2", "9 rad", "1.5708")),
    ],
)
def test_what_does_not_exist_is_refused_with_what_does(
    settings: dict[str, object], words: tuple[str, ...]
) -> None:
    with pytest.raises(SimError) as caught:
        make_world(**settings)
    assert [word for word in words if word not in str(caught.value)] == []


@pytest.mark.parametrize(
    ("kind", "values", "message"),
    [
        (PhysicsSettings, {"step_s": 1e-320}, r"step_s: .* of 1e-05 or more"),
        (PhysicsSettings, {"period_s": 0.003}, r"period is 0.003 s .* a multiple of the step"),
        (CameraSettings, {"exposure_s": 0.05}, r"takes 0.05 s, but at 30 Hz there are 0.03333 s"),
        (CameraSettings, {"rate_hz": -1.0}, r"CameraSettings.rate_hz: expected a number above 0"),
        (
            CameraSettings,
            {"rate_hz": 0.0333},
            r"^cameras.rate_hz is 0.0333; .* from 0.5 to 1000; if .* seconds, write 30.03$",
        ),
        (CameraSettings, {"rate_hz": 3e4}, r"^cameras.rate_hz is 30000; .* from 0.5 to 1000$"),
        (
            CameraSettings,
            {"latency_s": 40.0},
            r"^cameras.latency_s is 40; give at most 2 seconds; if milliseconds .*, write 0.04$",
        ),
        (
            ObjectSettings,
            {"hand_from_object": (0.0, -0.09, 0.545, 1.0, 0.0, 0.0, 0.0)},
            r"^object.hand_from_object is .* length 1 .*; write the rotation first: w, x, y, z, tx",
        ),
        (
            ArmSettings,
            {"world_from_hand": (0.1, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0)},
            r"^arm.world_from_hand is .* length 1 .*; write the rotation first: w, x, y, z, tx",
        ),
        (
            CameraSettings,
            {"samples": 1, "moments": 3},
            r"has 3 moments, but a pixel has only 1 ray;",
        ),
    ],
)
def test_settings_of_a_world_that_cannot_be_are_refused_when_they_are_made(
    kind: type, values: dict[str, object], message: str
) -> None:
    with pytest.raises(SimError, match=message):
        kind(**values)

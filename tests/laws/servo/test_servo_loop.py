import msgspec
import numpy as np
import pytest
from scenes_loop import NOISY
from servo_loop import (
    GOAL_FROM_OBJECT,
    WORLD_FROM_OBJECT,
    WORLD_FROM_START,
    Loop,
    Tick,
    broken_limits,
    goal_at,
    position_errors,
    rms,
    still,
    to_and_fro,
    turn_errors,
)
from tiers import tiered

from servoid._native import shifted_and_turned
from servoid.pose import Pose
from servoid.servo import GazeMode, JointLaw, Reason, ServoSettings
from servoid.servo.settings import GazeSettings, HandSettings, JointSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

LAWS = pytest.mark.parametrize("law", list(JointLaw), ids=lambda law: law.value)
LONG_LAWS = pytest.mark.parametrize(
    "law", tiered([JointLaw.QP, JointLaw.PAPER]), ids=lambda law: law.value
)
OFFSETS = [
    np.array([0.06, 0.17, 0.08, 0.0, 0.35, 0.0]),
    np.array([0.1, -0.15, 0.08, 0.2, -0.2, 0.2]),
    np.array([0.2, 0.0, 0.0, -0.35, 0.0, 0.0]),
]


def by(law: JointLaw, **changes: object) -> ServoSettings:
    return ServoSettings(joints=JointSettings(law=law), **changes)  # type: ignore[arg-type]


def test_offsets_are_as_far_off_as_the_law_says() -> None:
    for offset in OFFSETS:
        assert np.linalg.norm(offset[:3]) == pytest.approx(0.2, abs=0.01)
        assert np.degrees(np.linalg.norm(offset[3:])) == pytest.approx(20, abs=0.2)


@LAWS
@pytest.mark.parametrize("offset", tiered(OFFSETS))
def test_a_still_target_is_reached_within_a_tenth_of_a_millimetre(
    law: JointLaw, offset: np.ndarray
) -> None:
    loop = Loop(still(goal_at(offset)), by(law))
    loop.run(8)
    settled = loop.run(1)
    assert position_errors(settled).max() < 1e-4
    assert turn_errors(settled).max() < np.radians(0.02)
    assert broken_limits(loop) == []
    assert settled[-1].command.holding == settled[-1].command.limiting == frozenset()


@LAWS
def test_after_a_hold_the_hand_regains_its_speed_slowly(law: JointLaw) -> None:
    settings = by(law)
    ticks = Loop(still(goal_at(OFFSETS[0])), settings).run(1.5)
    moving = [tick for tick in ticks if not tick.command.holding]
    for tick in moving:
        share = min(1.0, (tick.time_s - moving[0].time_s) / settings.safety.resume_s)
        linear, angular = np.linalg.norm(tick.command.twist.reshape(2, 3), axis=1)
        # Where bounds meet, each gives way by less than a micrometre a second.
        assert linear <= share * settings.hand.linear_speed + 1e-6
        assert angular <= share * settings.hand.angular_speed + 1e-6
    assert max(np.linalg.norm(tick.command.twist[:3]) for tick in moving) > 0.1


@LONG_LAWS
def test_with_feed_forward_the_hand_follows_the_papers_path_within_two_millimetres(
    law: JointLaw,
) -> None:
    loop = Loop(to_and_fro(10), by(law))
    loop.run(4)
    assert rms(position_errors(loop.run(10))) < 2e-3
    assert broken_limits(loop) == []


@pytest.mark.extended
@LONG_LAWS
def test_without_feed_forward_the_hand_lags_as_the_paper_saw(law: JointLaw) -> None:
    loop = Loop(to_and_fro(10), by(law, hand=HandSettings(feed_forward=False)))
    loop.run(4)
    behind = []
    for tick in loop.run(10):
        motion = tick.command.twist[:3]
        if np.linalg.norm(motion) > 0.05:
            behind.append(tick.error[:3] @ motion / np.linalg.norm(motion))
    assert max(behind) < -5e-3


@LONG_LAWS
def test_noisy_estimates_are_followed_within_five_millimetres(law: JointLaw) -> None:
    assert NOISY[law].broken(0) == []


@LONG_LAWS
def test_a_desired_relation_that_moves_is_followed(law: JointLaw) -> None:
    def goal(time_s: float) -> Pose:
        turned = [
            0.02 * np.sin(time_s),
            0.0,
            0.05 * np.sin(0.7 * time_s),
            0.0,
            0.1 * np.sin(time_s),
            0.0,
        ]
        return Pose.exp(turned) @ GOAL_FROM_OBJECT

    loop = Loop(still(WORLD_FROM_OBJECT), by(law), goal=goal)
    loop.run(4)
    ticks = loop.run(6)
    assert rms(position_errors(ticks)) < 2e-3
    assert rms(turn_errors(ticks)) < np.radians(0.2)


@LONG_LAWS
@pytest.mark.parametrize("seed", tiered(range(3)))
def test_no_limit_is_broken_whatever_the_goals(law: JointLaw, seed: int) -> None:
    random = np.random.default_rng(seed)
    jumps = [random.uniform(-1, 1, 6) * np.repeat([0.4, 1.2], 3) for _ in range(4)]

    def goal(time_s: float) -> Pose:
        return GOAL_FROM_OBJECT @ Pose.exp(jumps[int(time_s) % 4])

    loop = Loop(to_and_fro(5), by(law), goal=goal)
    loop.run(5)
    assert broken_limits(loop) == []


@LONG_LAWS
def test_a_goal_behind_the_arm_drives_no_joint_into_its_limit(law: JointLaw) -> None:
    behind = shifted_and_turned(WORLD_FROM_OBJECT, np.array([2.4, 0.3, 0.0, 0.0, 0.0, 3.0]))
    loop = Loop(still(behind), by(law))
    loop.run(7)
    assert broken_limits(loop) == []
    calm = [np.abs(tick.state.velocities).max() for tick in loop.run(1)]
    assert max(calm) < 3.0


@LONG_LAWS
def test_near_a_singular_pose_speeds_stay_bounded(law: JointLaw) -> None:
    straight = np.zeros(10)
    straight[1:6] = -0.6, 0.0, -0.02, 0.0, 0.01
    arm = SerialArm(read_arm(), positions=straight.tolist())
    hand = arm.world_from_hand(straight)
    smallest = np.linalg.svd(arm.jacobian(straight))[1][-1]
    assert smallest < 0.01
    beyond = shifted_and_turned(hand, np.array([-0.1, 0.05, 0.15, 0.2, 0.0, 0.2]))
    loop = Loop(still(beyond @ GOAL_FROM_OBJECT), by(law), positions=straight)
    loop.run(6)
    assert broken_limits(loop) == []
    hand_speeds = [np.linalg.norm(tick.hand_twist[:3]) for tick in loop.ticks]
    assert max(hand_speeds) < 1.0


@LONG_LAWS
def test_both_eyes_stay_on_a_moving_target(law: JointLaw) -> None:
    loop = Loop(to_and_fro(10), by(law))
    loop.run(4)
    assert rms(np.array([tick.fixation for tick in loop.run(10)])) < 1e-3


@pytest.mark.extended
def test_eyes_that_only_react_see_the_target_drift() -> None:
    drifts = []
    for feed_forward in (True, False):
        settings = ServoSettings(
            gaze=GazeSettings(feed_forward=feed_forward),
            hand=HandSettings(feed_forward=False),
        )
        loop = Loop(to_and_fro(5), settings)
        loop.run(4)
        drifts.append(rms(np.array([tick.fixation for tick in loop.run(5)])))
    assert drifts[0] < 0.5 * drifts[1]


def test_parallel_eyes_look_straight_on() -> None:
    loop = Loop(to_and_fro(10), ServoSettings(gaze=GazeSettings(mode=GazeMode.PARALLEL)))
    loop.run(3)
    assert max(np.abs(tick.state.positions[7:]).max() for tick in loop.ticks) < 1e-9


def test_without_a_goal_the_hand_rests_and_the_eyes_follow() -> None:
    loop = Loop(to_and_fro(10), goal=lambda _: None)
    loop.run(2)
    ticks = loop.run(5)
    assert max(np.abs(tick.state.velocities[:7]).max() for tick in ticks) < 1e-9
    assert rms(np.array([tick.fixation for tick in ticks])) < 2e-3


def looked_around(
    point: np.ndarray, goal: Pose, settings: ServoSettings
) -> tuple[Loop, list[Tick]]:
    loop = Loop(still(Pose.from_parts(point.tolist(), [1, 0, 0, 0])), settings)
    ticks = []
    while loop.arm.time_s < 8:
        state = loop.arm.state()
        command = loop.controller.go_to(state, goal, point)
        ticks.append(loop._tick(state, command))
        loop.arm.command(command.velocities)
    loop.ticks = ticks
    return loop, ticks


@LONG_LAWS
def test_the_hand_goes_to_a_viewpoint_while_the_eyes_keep_a_point(law: JointLaw) -> None:
    point = np.array(WORLD_FROM_OBJECT.translation)
    goal = goal_at(np.array([0.1, 0.15, 0.1, 0.0, 0.0, 0.2])) @ GOAL_FROM_OBJECT.inverse()
    loop, ticks = looked_around(point, goal, by(law))
    reached = ticks[-1].command.hand_from_goal
    assert reached is not None
    assert np.linalg.norm(reached.log()) < 1e-4
    assert max(tick.fixation for tick in ticks[100:]) < 5e-3
    assert broken_limits(loop) == []


def test_the_hand_stays_in_its_workspace() -> None:
    settings = ServoSettings()
    box = msgspec.structs.replace(settings.safety, workspace_upper=(1.5, 0.1, 2.0))
    loop = Loop(to_and_fro(10), msgspec.structs.replace(settings, safety=box))
    ticks = loop.run(10)
    assert (
        max(loop.arm.world_from_hand(tick.state.positions).translation[1] for tick in ticks) < 0.101
    )
    assert any(Reason.WORKSPACE in tick.command.limiting for tick in ticks)
    assert position_errors(ticks[-25:]).max() < 5e-3  # by then the target is back inside


@LONG_LAWS
def test_the_hand_keeps_its_distance_from_the_object(law: JointLaw) -> None:
    ahead, near = (Pose.from_parts([0.0, 0.0, z], [1.0, 0.0, 0.0, 0.0]) for z in (0.35, 0.1))
    loop = Loop(still(WORLD_FROM_START @ ahead), by(law), goal=lambda _: near)
    ticks = loop.run(8)
    place = np.array((WORLD_FROM_START @ ahead).translation)
    distances = [
        np.linalg.norm(loop.arm.world_from_hand(tick.state.positions).translation - place)
        for tick in ticks
    ]
    least = ServoSettings().safety.least_distance
    assert least - 1e-3 < min(distances) < least + 0.02
    assert any(Reason.NEAR in tick.command.limiting for tick in ticks)


@pytest.mark.extended
@LONG_LAWS
def test_the_hand_gives_way_to_an_object_that_comes_nearer(law: JointLaw) -> None:
    def coming(time_s: float) -> Pose:
        ahead = 0.35 * min(1.0, max(0.0, (time_s - 2) / 5))
        return shifted_and_turned(WORLD_FROM_OBJECT, np.array([ahead, 0, 0, 0, 0, 0]))

    fixed = WORLD_FROM_OBJECT @ GOAL_FROM_OBJECT.inverse()
    loop = Loop(coming, by(law), goal=lambda time_s: fixed.inverse() @ coming(time_s))
    ticks = loop.run(9)
    distances = [
        np.linalg.norm(
            np.subtract(
                loop.arm.world_from_hand(tick.state.positions).translation,
                coming(tick.time_s).translation,
            )
        )
        for tick in ticks
    ]
    assert min(distances) > ServoSettings().safety.least_distance - 0.005


@LAWS
def test_the_same_run_gives_the_same_bits(law: JointLaw) -> None:
    runs = [Loop(to_and_fro(10), by(law), noise=(0.0005, 0.005)) for _ in range(2)]
    last = [loop.run(2)[-1].state.positions for loop in runs]
    assert np.array_equal(*last)

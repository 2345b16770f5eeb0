"""Laws of what the loop does when the arm's own driver stops it."""

from dataclasses import replace
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from linked_joints import Bench
from servo_loop import GOAL_FROM_OBJECT, WORLD_FROM_OBJECT, Loop, broken_limits, still, to_and_fro
from servo_trials import logged, small_settings, small_trial

from servoid.errors import ServoError
from servoid.pose import Pose
from servoid.servo import Controller, JointState, LookSettings, Reason, awaited, visit
from servoid.servo.exploration import first_look
from servoid.servo.link import Refusal
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.sim.trial import run_servo_trial
from servoid.sim.world import World

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")


class Stopping(Loop):
    """A loop whose arm is stopped by its driver between two times, and follows no command then."""

    stops = (1.0, 2.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        arm, state, command = self.arm, self.arm.state, self.arm.command
        self.braking = np.zeros(len(arm.joints.names))

        def stopped() -> bool:
            return self.stops[0] <= arm.time_s < self.stops[1]

        def obey(velocities: np.ndarray) -> None:
            step = arm.joints.acceleration * arm.period_s
            braked = self.braking - np.clip(self.braking, -step, step)
            self.braking = braked if stopped() else velocities
            command(self.braking)

        arm.state = lambda: replace(state(), stopped=stopped())  # type: ignore[method-assign]
        arm.command = obey  # type: ignore[method-assign]


def test_a_protective_stop_holds_the_hand_and_is_told_until_it_is_reset() -> None:
    loop = Stopping(to_and_fro(6.0))
    ticks = loop.run(4.0)
    commanded = [Reason.PROTECTIVE_STOP in tick.command.holding for tick in ticks]
    during = [1.0 <= tick.time_s < 2.0 for tick in ticks]
    assert commanded == during
    # What else may hold the arm does not: the object is seen all the time.
    assert all(len(tick.command.holding) <= 1 for tick in ticks[len(ticks) // 8 :])
    assert broken_limits(loop) == []
    settled = [tick for tick in ticks if 1.6 < tick.time_s < 2.0]
    assert all(not tick.command.velocities[:7].any() for tick in settled)


def test_after_a_reset_the_hand_regains_its_speed_gradually() -> None:
    loop = Stopping(to_and_fro(6.0))
    loop.run(4.0)
    hand = loop.settings.hand
    for tick in loop.ticks:
        since = tick.time_s - 2.0
        if since >= 0.0:
            share = min(1.0, (since + 2 * loop.arm.period_s) / loop.settings.safety.resume_s)
            speed = np.linalg.norm(tick.command.twist[:3])
            assert speed <= share * hand.speed_share * hand.linear_speed + 1e-9
    assert np.linalg.norm(loop.ticks[-1].error[:3]) < 0.02


def test_an_arm_that_is_stopped_on_its_way_to_a_look_ends_the_tour() -> None:
    arm = SerialArm(read_arm())
    state = arm.state
    arm.state = lambda: replace(state(), stopped=arm.time_s > 0.5)  # type: ignore[method-assign]
    here = arm.world_from_hand(arm.state().positions)
    goal = Pose.from_parts(np.add(here.translation, (0.0, 0.2, 0.0)).tolist(), here.quaternion)
    place = (here @ GOAL_FROM_OBJECT).translation
    going = visit(arm, Nothing(), Controller(arm), (goal, np.array(place)), LookSettings())  # type: ignore
    with pytest.raises(ServoError, match="and reset the arm"):
        list(islice(going, 1000))
    assert arm.time_s < 0.6


def test_an_arm_that_is_stopped_while_it_waits_for_images_is_told_and_not_the_cameras() -> None:
    for look in (awaited, first_look):
        arm = SerialArm(read_arm())
        state = arm.state
        arm.state = lambda arm=arm, state=state: replace(  # type: ignore[method-assign]
            state(), stopped=arm.time_s > 0.5
        )
        with pytest.raises(
            ServoError, match=r"stopped it while it waited .*protective stop.*reset"
        ):
            look(arm, Nothing())  # type: ignore
        assert arm.time_s < 0.6


@pytest.mark.skipif(find_spec("mujoco") is None, reason="simulated worlds need mujoco")
@pytest.mark.extended
def test_an_arm_that_is_stopped_after_it_explored_is_told_and_not_the_texture(
    tmp_path: Path,
) -> None:
    def stop_soon(world: World) -> None:
        state = world.arm.state
        world.arm.state = lambda: replace(  # type: ignore[method-assign]
            state(), stopped=world.time_s > 0.2
        )

    settings = small_settings({"servo.look.count": 1})
    with pytest.raises(ServoError, match=r"stopped it while it waited .*protective stop"):
        run_servo_trial(settings, tmp_path, prepared=stop_soon)


class Nothing:
    """A source that delivers nothing."""

    cameras = ()

    def newest(self) -> None:
        return None


def test_a_stopped_arm_goes_nowhere() -> None:
    arm = SerialArm(read_arm())
    controller = Controller(arm)
    state = replace(arm.state(), stopped=True)
    command = controller.go_to(state, Pose.identity(), np.zeros(3))
    assert command.holding == {Reason.PROTECTIVE_STOP}
    assert not command.velocities.any()


def test_a_driver_whose_arm_is_stopped_ends_the_session_and_starts_none() -> None:
    class Hit(Bench):
        stopped = False

        @property
        def state(self) -> JointState:
            return replace(self.arm.state(), stopped=self.stopped)

    bench = Hit()
    bench.start()
    bench.drive(0.3, 0.5)
    bench.stopped = True
    bench.step(0.3)
    assert "protective stop" in bench.receiver.ended
    assert not bench.commanded[-1].any() and bench.broken_limits() == []
    assert bench.start() is Refusal.STOPPED
    bench.stopped = False
    assert bench.start() is None


@pytest.mark.skipif(find_spec("mujoco") is None, reason="simulated worlds need mujoco")
@pytest.mark.extended
def test_an_object_that_hits_the_hand_ends_in_a_stop_that_the_log_tells(tmp_path: Path) -> None:
    values = {
        "run.seconds": 4.0,
        "run.goal": [0.0, 0.0, 0.545],
        "world.object.hand_from_object": [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.545],
        "world.object.path": "line:1.5@1.5s:-z",  # faster than the hand gives way
        "servo.look.count": 1,
    }
    trial = small_trial(tmp_path, values)
    rows = logged(trial, tmp_path)
    places = [index for index, row in enumerate(rows) if "protective_stop" in row["holding"]]
    assert places and places == list(range(places[0], len(rows)))
    moved = trial.log.positions[places[-1]] - trial.log.positions[places[-1] - 20]
    assert np.abs(moved).max() < 1e-3


def test_an_arm_that_says_nothing_of_stops_is_held_by_none() -> None:
    ticks = Loop(still(WORLD_FROM_OBJECT)).run(1.0)
    assert not any(Reason.PROTECTIVE_STOP in tick.command.holding for tick in ticks)

"""Laws of arms whose states stop, or whose joints do not do what was commanded: they are held."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from servo_loop import PERIOD_S, WORLD_FROM_START, Loop, goal_at, still

from servoid._native import shifted_and_turned
from servoid.errors import ServoError
from servoid.pose.exact import Floats
from servoid.servo import Controller, JointState, Reason
from servoid.servo.keeping.arm_watch import ArmWatch
from servoid.servo.next_best_view import visit
from servoid.servo.settings import HandSettings, LookSettings, SafetySettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

OFFSET = np.array([0.1, 0.25, 0.1, 0.3, 0.2, 0.3])
EXCHANGED = [0, 2, 1, *range(3, 10)]
MOVES = 0.05  # rad/s of the fastest joint, above which the arm counts as moving

Spoil = Callable[[SerialArm], None]


def spoil_nothing(_arm: SerialArm) -> None:
    pass


def stop_states(arm: SerialArm) -> None:
    last = arm.state()
    arm.state = lambda: last


def freeze_joints(arm: SerialArm) -> None:
    last = arm.state()
    arm.state = lambda: replace(last, time_s=arm.time_s)


def freeze_positions(arm: SerialArm) -> None:
    last = replace(arm.state(), velocities=np.zeros(10))
    arm.state = lambda: replace(last, time_s=arm.time_s)


def exchange_states(arm: SerialArm) -> None:
    def state() -> JointState:
        true = SerialArm.state(arm)
        return JointState(true.time_s, true.positions[EXCHANGED], true.velocities[EXCHANGED])

    arm.state = state


def exchange_commands(arm: SerialArm) -> None:
    arm.command = lambda speeds: SerialArm.command(arm, speeds[EXCHANGED])


def turn_a_sign(arm: SerialArm) -> None:
    signs = np.where(np.arange(10) == 3, -1.0, 1.0)
    arm.command = lambda speeds: SerialArm.command(arm, signs * speeds)


def ignore_commands(arm: SerialArm) -> None:
    arm.command = lambda speeds: SerialArm.command(arm, 0.0 * speeds)


FROZEN = [(stop_states, 0.12), (freeze_joints, 0.25), (freeze_positions, 0.25)]
DISOBEYING = [exchange_states, exchange_commands, turn_a_sign, ignore_commands]
BY = pytest.mark.parametrize("by_estimates", [True, False], ids=["command", "go_to"])


def true_place(arm: SerialArm) -> Floats:
    return np.array(arm.world_from_hand(SerialArm.state(arm).positions).translation)


Tick = tuple[float, frozenset[Reason], Floats, Floats]


class Run:
    """An arm on its way to a goal, by `command` or by `go_to`, that is spoilt at a time."""

    def __init__(self, spoil: Spoil, after_s: float, *, by_estimates: bool) -> None:
        self.loop = Loop(still(goal_at(OFFSET)))
        self.arm = self.loop.arm
        self.by_estimates = by_estimates
        self.goal = shifted_and_turned(WORLD_FROM_START, OFFSET)
        self.point = np.array(goal_at(OFFSET).translation)
        self.run(after_s)
        spoil(self.arm)
        self.spoilt_s = self.arm.time_s
        self.first = true_place(self.arm)

    def run(self, seconds: float) -> list[Tick]:
        """Return the time, the reasons, the command and the true place of the hand, by ticks."""
        found, end_s = [], self.arm.time_s + seconds
        while self.arm.time_s < end_s:
            time_s, place = self.arm.time_s, true_place(self.arm)
            if self.by_estimates:
                command = self.loop.run(0.5 * PERIOD_S)[-1].command
            else:
                command = self.loop.controller.go_to(self.arm.state(), self.goal, self.point)
                self.arm.command(command.velocities)
            found.append((time_s, command.holding, command.velocities, place))
        return found


def held_s(ticks: list[Tick], reason: Reason) -> float:
    """Return when a reason first held the hand."""
    return next(time_s for time_s, holding, _, _ in ticks if reason in holding)


@BY
@pytest.mark.parametrize(("spoil", "most_s"), FROZEN)
def test_joint_states_that_freeze_hold_the_hand_before_it_goes_far(
    spoil: Spoil, most_s: float, by_estimates: bool
) -> None:
    run = Run(spoil, 1.2 if by_estimates else 0.6, by_estimates=by_estimates)
    ticks = run.run(4.0)
    reason = Reason.STALE if spoil is stop_states else Reason.DISOBEYED
    since_s = held_s(ticks, reason)
    assert since_s - run.spoilt_s <= most_s
    assert all(holding == {reason} for time_s, holding, _, _ in ticks if time_s >= since_s)
    assert max(np.linalg.norm(place - run.first) for *_, place in ticks) < 0.16
    assert not ticks[-1][2].any()


@BY
@pytest.mark.parametrize("spoil", DISOBEYING)
def test_joints_that_do_otherwise_than_commanded_hold_the_hand_before_it_goes_far(
    spoil: Spoil, by_estimates: bool
) -> None:
    run = Run(spoil, 0.0, by_estimates=by_estimates)
    ticks = run.run(4.0)
    moving_s = next(time_s for time_s, _, speeds, _ in ticks if np.abs(speeds).max() > MOVES)
    since_s = held_s(ticks, Reason.DISOBEYED)
    assert since_s - moving_s <= 0.8  # the first speeds are low, as after each hold
    assert all(holding == {Reason.DISOBEYED} for at_s, holding, *_ in ticks if at_s >= since_s)
    assert max(np.linalg.norm(place - run.first) for *_, place in ticks) < 0.2
    assert not ticks[-1][2].any()


def test_a_frozen_arm_does_not_creep_however_near_its_goal_seems() -> None:
    run = Run(spoil_nothing, 0.0, by_estimates=False)
    while True:
        run.run(PERIOD_S)
        off = np.linalg.norm(true_place(run.arm) - np.array(run.goal.translation))
        if off < 0.005:
            break
    freeze_positions(run.arm)
    first = true_place(run.arm)
    ticks = run.run(20.0)
    assert max(np.linalg.norm(place - first) for *_, place in ticks) < 0.08
    assert Reason.DISOBEYED in ticks[-1][1]


def test_states_that_come_again_end_the_hold_and_the_hand_regains_its_speed_gradually() -> None:
    run = Run(stop_states, 0.8, by_estimates=True)
    assert run.run(1.0)[-1][1] == {Reason.STALE}
    run.arm.state = lambda: SerialArm.state(run.arm)
    ticks = run.run(6.0)
    again = [tick for tick in ticks if not tick[1]]
    assert again[0][0] - ticks[0][0] < 0.6  # after as many images as after other holds
    safety, fastest = SafetySettings(), HandSettings().linear_speed
    for before, after in pairwise(again):
        speed = np.linalg.norm(after[3] - before[3]) / PERIOD_S
        assert speed <= fastest * (after[0] - again[0][0]) / safety.resume_s + 0.01
    assert np.linalg.norm(ticks[-1][3] - np.array(run.goal.translation)) < 1e-3


@pytest.mark.parametrize("repeats", [2, 3, 6])
def test_states_that_come_more_seldom_than_commands_are_not_said_to_stop(repeats: int) -> None:
    run, kept = Run(spoil_nothing, 0.0, by_estimates=False), []

    def state() -> JointState:
        kept.append(SerialArm.state(run.arm))
        return kept[(len(kept) - 1) // repeats * repeats]

    run.arm.state = state
    ticks = run.run(4.0)
    assert not any(holding & {Reason.STALE, Reason.DISOBEYED} for _, holding, _, _ in ticks)
    assert np.linalg.norm(ticks[-1][3] - np.array(run.goal.translation)) < 1e-3


def test_only_a_resume_lets_an_arm_move_again_that_did_not_obey() -> None:
    run = Run(ignore_commands, 0.0, by_estimates=True)
    run.run(3.0)
    run.arm.command = lambda speeds: SerialArm.command(run.arm, speeds)
    assert {holding for _, holding, _, _ in run.run(5.0)} == {frozenset({Reason.DISOBEYED})}
    run.loop.controller.resume()
    ticks = run.run(6.0)
    assert not ticks[-1][1]
    assert np.linalg.norm(ticks[-1][3] - np.array(run.goal.translation)) < 1e-3


def test_a_stop_that_the_arm_reports_explains_why_it_does_not_obey() -> None:
    run = Run(ignore_commands, 0.0, by_estimates=True)
    run.arm.state = lambda: replace(SerialArm.state(run.arm), stopped=True)
    assert not any(Reason.DISOBEYED in holding for _, holding, _, _ in run.run(3.0))
    run.arm.command = lambda speeds: SerialArm.command(run.arm, speeds)
    run.arm.state = lambda: SerialArm.state(run.arm)
    assert not run.run(3.0)[-1][1]


@pytest.mark.parametrize("spoil", [stop_states, ignore_commands])
def test_a_tour_of_looks_ends_when_the_arm_does_not_obey_or_its_states_stop(spoil: Spoil) -> None:
    class Nothing:
        cameras = ()

        def newest(self) -> None:
            return None

    arm = SerialArm(read_arm(), PERIOD_S)
    goal = shifted_and_turned(WORLD_FROM_START, OFFSET), np.array(goal_at(OFFSET).translation)
    spoil(arm)
    with pytest.raises(ServoError, match="on the way to the next viewpoint"):
        list(visit(arm, Nothing(), Controller(arm), goal, LookSettings()))


def followed(time_s: float, speed: float, *, wraps: bool = False) -> JointState:
    """Return the state of joints that move at a speed and measure none."""
    place = speed * time_s
    place = (place + np.pi) % (2.0 * np.pi) - np.pi if wraps else place
    return JointState(time_s, np.full(7, place), np.zeros(7))


def test_encoders_that_begin_anew_after_a_turn_are_no_fault() -> None:
    watch = ArmWatch(SafetySettings(), 0.01, 7)
    for tick in range(1500):
        assert watch.see(followed(0.01 * tick, 1.0, wraps=True), np.full(7, 1.0))


def test_a_pause_of_the_program_is_no_fault_of_joints_that_go_on_and_measure_no_speeds() -> None:
    watch, speeds = ArmWatch(SafetySettings(), 0.01, 7), np.full(7, 1.0)
    # The driver keeps the last command, and the new one takes effect late.
    for tick in [*range(200), *range(215, 240)]:
        assert watch.see(followed(0.01 * tick, 1.0), speeds)
    for tick in range(1, 200):
        time_s = 2.4 + 0.01 * tick
        place = 2.4 + 0.05 * (1.0 - np.exp(-0.01 * tick / 0.05))
        assert watch.see(JointState(time_s, np.full(7, place), np.zeros(7)), np.zeros(7))


@pytest.mark.parametrize("stale_s", [0.1, 1e6])
@pytest.mark.parametrize("gap_s", [1.0, 3600.0, 1.8e9])
def test_a_clock_that_jumps_takes_no_time_and_is_no_disobedience(
    stale_s: float, gap_s: float
) -> None:
    watch = ArmWatch(SafetySettings(stale_s=stale_s), 0.01, 7)
    kept: list[int] = []
    watch._motions._keep = lambda row: kept.append(len(row))
    for tick in range(100):
        assert watch.see(followed(0.01 * tick, 0.0), np.zeros(7))
    for tick in range(100):
        assert watch.see(followed(gap_s + 0.01 * tick, 0.0), np.zeros(7))
    assert len(kept) < 300


def test_an_arm_that_is_stopped_and_sends_no_newer_states_is_said_to_be_stopped() -> None:
    run = Run(spoil_nothing, 0.5, by_estimates=True)
    last = replace(run.arm.state(), stopped=True)
    run.arm.state = lambda: last
    assert all(Reason.STALE not in holding for _, holding, _, _ in run.run(1.0))
    assert Reason.PROTECTIVE_STOP in run.run(0.1)[-1][1]


def test_one_state_that_comes_twice_is_no_fault_however_slow_the_control_is() -> None:
    watch = ArmWatch(SafetySettings(), 0.2, 7)
    for tick in range(20):
        assert watch.see(followed(0.4 * (tick // 2), 0.0), np.zeros(7))


@settings(max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    period_s=st.sampled_from([0.004, 0.008, 0.016, 0.03]),
    lag_s=st.floats(0.0, 0.1),
    latency_s=st.floats(0.0, 0.1),
    share=st.floats(0.7, 1.0),
)
@example(seed=0, period_s=0.008, lag_s=0.1, latency_s=0.1, share=0.7)
def test_no_arm_with_lag_latency_gaps_and_saturated_speeds_is_held(
    seed: int, period_s: float, lag_s: float, latency_s: float, share: float
) -> None:
    """Command random speeds of up to 2 rad/s, which the arm reaches up to a share."""
    random, step_s, fastest = np.random.default_rng(seed), 0.002, 2.0
    watch = ArmWatch(SafetySettings(), period_s, 7)
    speeds, goes, wanted = np.zeros((3, 7))
    places = [np.zeros(7)]
    next_s, gap_until_s, kept = 0.0, -1.0, places[0]
    for step in range(int(5.0 / step_s)):
        time_s = step * step_s
        if time_s >= next_s:
            if time_s > gap_until_s:
                kept = places[max(0, step - round(latency_s / step_s))]
                if random.uniform() < 2.0 * period_s:  # states are lost, twice a second
                    gap_until_s = time_s + random.uniform(0.0, 0.05)
            read = kept + random.normal(size=7) * 1e-4
            assert watch.see(JointState(time_s, read, goes), speeds)
            if random.uniform() < 2.0 * period_s:
                wanted = (
                    random.uniform(-1.0, 1.0, 7) * random.choice([0.0, 0.1, 0.5, 1.0]) * fastest
                )
            speeds = speeds + np.clip(wanted - speeds, -8.0 * period_s, 8.0 * period_s)
            next_s = time_s + period_s * random.choice([1.0, 1.0, 1.0, 1.3, 3.0])
        reached = np.clip(speeds, -share * fastest, share * fastest)
        goes = goes + (reached - goes) * (1.0 - np.exp(-step_s / max(lag_s, 1e-4)))
        places.append(places[-1] + step_s * goes)

"""Laws of joints that follow late: it is measured and told, and they brake as much earlier."""

from dataclasses import replace

import numpy as np
import pytest
from servo_loop import Loop, Tick, goal_at, still

from servoid.servo import ORDINARY, Controller, JointState, Reason, ServoSettings
from servoid.servo.keeping.arm_watch import ArmWatch
from servoid.servo.keeping.joint_lag import STEP_S, WINDOW, JointLag
from servoid.servo.settings import JointSettings, SafetySettings
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm

PERIOD_S, WALL_M = 0.008, 0.15
BEYOND = np.array([0.0, -0.4, 0.0, 0.0, 0.0, 0.0])  # the wall
REACTION_S = JointSettings().reaction_s


class LateArm(SerialArm):
    """An arm with another lag of its joints, whose states are late by a latency."""

    def __init__(self, lag_s: float | None, latency_s: float) -> None:
        super().__init__(read_arm(), PERIOD_S)
        if lag_s is not None:
            self._lag_s = np.full(len(self.joints.names), lag_s)
        self.late, self.went = round(latency_s / PERIOD_S), [super().state()]

    def command(self, velocities: np.ndarray) -> None:
        super().command(velocities)
        self.went.append(super().state())

    def state(self) -> JointState:
        return replace(self.went[max(0, len(self.went) - 1 - self.late)], time_s=self.time_s)


def at_wall(
    lag_s: float | None, latency_s: float, reaction_s: float = REACTION_S
) -> tuple[list[Tick], float]:
    """Return the ticks of an arm whose goal is beyond a wall, and how far it went through, in m."""
    arm = LateArm(lag_s, latency_s)
    wall = arm.world_from_hand(arm.state().positions).translation[1] - WALL_M
    room = SafetySettings(workspace_lower=(-5.0, wall, -5.0), workspace_upper=(5.0, 5.0, 5.0))
    joints = JointSettings(reaction_s=reaction_s)
    loop = Loop(still(goal_at(BEYOND)), ServoSettings(safety=room, joints=joints))
    loop.arm, loop.controller = arm, Controller(arm, loop.settings)
    ticks = loop.run(4.0)
    hands = [arm.world_from_hand(state.positions).translation[1] for state in arm.went]
    return ticks, wall - min(hands)


LATE = [(0.1, 0.0), (None, 0.1), (None, 0.2), (0.1, 0.1)]


@pytest.mark.parametrize(("lag_s", "latency_s"), LATE)
def test_the_lag_of_late_joints_is_told_and_keeps_them_out_of_the_wall_nearly_as_if_it_was_set(
    lag_s: float | None, latency_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    true_s = (lag_s or 0.0) + latency_s
    ticks, through = at_wall(lag_s, latency_s)
    told = [tick for tick in ticks if Reason.LAGGING in tick.command.limiting]
    assert told[0].time_s < 0.65  # it moves from 0.4 s on
    assert told[-1].command.late_s == pytest.approx(true_s, abs=0.04)
    _, known = at_wall(lag_s, latency_s, true_s + REACTION_S)
    assert through < known + 0.005
    monkeypatch.setattr(ArmWatch, "late_s", 0.0)
    _, blind = at_wall(lag_s, latency_s)
    assert blind > 2.5 * through


@pytest.mark.parametrize("lag_s", [None, 0.02, 0.05])
def test_joints_in_time_are_not_told_as_late_and_keep_their_commands_to_the_bit(
    lag_s: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    ticks, _ = at_wall(lag_s, 0.0)
    assert all(tick.command.late_s == 0.0 for tick in ticks)
    monkeypatch.setattr(ArmWatch, "late_s", 0.0)
    for one, other in zip(ticks, at_wall(lag_s, 0.0)[0], strict=True):
        np.testing.assert_array_equal(one.command.velocities, other.command.velocities)


def test_a_lag_that_is_allowed_for_is_not_told() -> None:
    ticks, _ = at_wall(None, 0.1, 0.1)
    assert all(tick.command.late_s == 0.0 for tick in ticks)


def test_a_lag_does_not_count_as_what_keeps_the_hand_from_its_goal() -> None:
    assert Reason.LAGGING in ORDINARY


def measured_s(seed: int, lag_s: float, latency_s: float, share: float) -> list[float]:
    """Command random speeds, which joints reach up to a share; return the lags that were told.

    Encoders are noisy, commands come irregularly, and states are lost twice a second.
    """
    random, step_s, fastest = np.random.default_rng(seed), 0.002, 2.0
    watch = ArmWatch(SafetySettings(), PERIOD_S, 7, REACTION_S)
    speeds, goes, wanted = np.zeros((3, 7))
    places, kept = [np.zeros(7)], np.zeros(7)
    next_s, gap_until_s, told = 0.0, -1.0, []
    for step in range(int(5.0 / step_s)):
        time_s = step * step_s
        if time_s >= next_s:
            if time_s > gap_until_s:
                kept = places[max(0, step - round(latency_s / step_s))]
                if random.uniform() < 2.0 * PERIOD_S:
                    gap_until_s = time_s + random.uniform(0.0, 0.05)
            read = kept + random.normal(size=7) * 1e-4
            assert watch.see(JointState(time_s, read, goes), speeds)
            told.append(watch.late_s)
            if random.uniform() < 2.0 * PERIOD_S:
                wanted = random.uniform(-1.0, 1.0, 7) * random.choice([0.0, 0.1, 0.5, 1.0])
            speeds = speeds + np.clip(fastest * wanted - speeds, -8.0 * PERIOD_S, 8.0 * PERIOD_S)
            next_s = time_s + PERIOD_S * random.choice([1.0, 1.0, 1.0, 1.3, 3.0])
        reached = np.clip(speeds, -share * fastest, share * fastest)
        goes = goes + (reached - goes) * (1.0 - np.exp(-step_s / max(lag_s, 1e-4)))
        places.append(places[-1] + step_s * goes)
    return told


@pytest.mark.parametrize("share", [1.0, 0.7])
@pytest.mark.parametrize("seed", range(4))
def test_a_lag_is_measured_whatever_joints_are_commanded(seed: int, share: float) -> None:
    for lag_s, latency_s in ((0.0, 0.0), (0.05, 0.0), (0.02, 0.02)):
        assert not any(measured_s(seed, lag_s, latency_s, share))
    for latency_s in (0.1, 0.2):
        told = [one for one in measured_s(seed, 0.0, latency_s, share) if one > 0.0]
        assert np.median(told) == pytest.approx(latency_s, abs=0.02)


def test_a_creep_after_a_fast_motion_tells_no_other_lag() -> None:
    """Joints that settle creep by what the eyes correct, later than any command that moved them."""
    lag = JointLag(REACTION_S)
    rows = np.arange(2 * WINDOW + 1)[:, None] * STEP_S

    def see(radians: float, late_s: float) -> None:
        commanded = radians * np.sin(2.0 * rows)
        lag.see(commanded, radians * np.sin(2.0 * (rows[WINDOW:] - late_s)))

    for _ in range(4):
        see(1.0, 0.0)
    for late_s in (0.18, 0.2, 0.22):
        see(0.05, late_s)
    assert lag.late_s == 0.0
    for _ in range(3):
        see(0.5, 0.2)
    assert lag.late_s == pytest.approx(0.2, abs=0.01)

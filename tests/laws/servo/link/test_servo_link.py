"""What counts on the joints' side of the link, step by step of its own clock."""

import json

import msgspec
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from linked_joints import SETTINGS, Bench

from servoid.errors import ServoError
from servoid.servo.link import LinkSettings, Phase, Refusal, Start, StoppingTrajectory
from servoid.servo.link.messages import from_driver, from_loop, line_of
from servoid.sim.joint_driver import PERIOD_S

SHARES = st.lists(st.floats(-1.0, 1.0), min_size=10, max_size=10).map(np.array)
BRAKING_S = 0.25 / SETTINGS.braking_share  # of the PA-10's joints from their fastest speeds


@example(share=np.array([*np.zeros(9), 5e-324]), hold_s=0.5, tiny=1.0)
@given(share=SHARES, hold_s=st.floats(0.01, 0.5), tiny=st.sampled_from([1.0, 1e-3, 1e-9, 1e-300]))
def test_every_command_is_a_motion_within_limits_that_ends_at_rest(
    share: np.ndarray, hold_s: float, tiny: float
) -> None:
    bench = Bench(LinkSettings(hold_s=hold_s))
    motion = bench.motion(tiny * share)
    assert motion.fault(bench.joints, hold_s) is None
    assert np.array_equal(motion.at(0.0), motion.at(0.999 * hold_s))
    assert not motion.at(motion.end_s).any()
    assert motion.end_s <= hold_s + BRAKING_S + 1e-9
    # The hand brakes along its way: its joints keep their ratios.
    half = motion.at(0.5 * (hold_s + motion.end_s))[:7]
    np.testing.assert_allclose(half * np.abs(motion.speeds[0][:7]).max(),
                               motion.speeds[0][:7] * np.abs(half).max(), atol=1e-12)  # fmt: skip


def test_joints_do_what_fresh_commands_say() -> None:
    bench = Bench()
    assert bench.start() is None
    bench.drive(0.2, 1.0)
    np.testing.assert_allclose(bench.state.velocities, 0.2 * bench.joints.speed, rtol=1e-3)
    assert bench.broken_limits() == []
    assert bench.receiver.phase is Phase.RUNNING


@pytest.mark.parametrize("share", [0.05, 0.5, 1.0])
def test_silence_brings_the_joints_to_rest_and_ends_the_session(share: float) -> None:
    bench = Bench()
    bench.start()
    bench.drive(share, 0.6)
    session, before = bench.receiver.session, len(bench.commanded)
    bench.step(1.0)
    at_rest = before + next(
        i for i, commanded in enumerate(bench.commanded[before:]) if not commanded.any()
    )
    assert not np.any(bench.commanded[at_rest:])
    silent_s = (at_rest - before) * PERIOD_S + 0.008  # the last command was a period old
    assert silent_s <= 0.15 + share * BRAKING_S
    assert bench.receiver.phase is Phase.WAITING
    assert bench.receiver.ended == "no command came in time"
    assert bench.receiver.session != session
    assert bench.broken_limits() == []


def test_a_session_needs_its_start_and_its_name() -> None:
    bench = Bench()
    assert bench.take(0.2) is Refusal.NOT_STARTED
    bench.step(0.1)
    assert bench.start() is None
    assert bench.take(0.2, session="another") is Refusal.OTHER_SESSION
    assert bench.start() is Refusal.OTHER_SESSION  # it has begun
    bench.step(0.1)
    assert not np.any(bench.commanded)
    assert bench.take(0.2) is None


def test_a_start_without_commands_moves_nothing_and_lapses() -> None:
    bench = Bench()
    bench.start()
    bench.step(SETTINGS.first_s + 0.1)
    assert not np.any(bench.commanded)
    assert bench.receiver.phase is Phase.WAITING


def test_a_loop_that_ends_before_its_first_command_makes_room_at_once() -> None:
    bench = Bench()
    bench.start()
    bench.receiver.end("the connection is closed")
    bench.step()
    assert bench.start() is None


def test_joints_that_still_move_are_not_started() -> None:
    bench = Bench()
    bench.start()
    bench.drive(0.5, 0.4)
    bench.receiver.end("the connection is closed")
    bench.step()
    assert bench.start() is Refusal.MOVING
    assert bench.take(0.5) is Refusal.NOT_STARTED
    bench.step(0.5)
    assert bench.receiver.is_at_rest
    assert bench.start() is None


def test_duplicates_and_old_numbers_do_not_count_and_gaps_are_counted() -> None:
    bench = Bench()
    bench.start()
    assert bench.take(0.1, number=5) is None
    bench.step(0.008)
    assert bench.take(0.9, number=5) is Refusal.OLD_NUMBER
    assert bench.take(0.9, number=3) is Refusal.OLD_NUMBER
    assert bench.take(0.1, number=8) is None
    assert (bench.receiver.accepted, bench.receiver.missing) == (8, 4 + 2)
    assert bench.receiver.refused[Refusal.OLD_NUMBER] == 2


def test_old_and_early_stamps_do_not_count() -> None:
    bench = Bench()
    bench.start()
    bench.drive(0.1, 0.4)
    now_s = bench.state.time_s
    assert bench.take(0.9, stamp_s=now_s - SETTINGS.hold_s) is Refusal.OLD_STAMP
    assert bench.take(0.9, stamp_s=now_s + PERIOD_S) is Refusal.EARLY_STAMP
    assert bench.take(0.1, stamp_s=now_s) is None
    assert bench.take(0.9, stamp_s=now_s - PERIOD_S) is Refusal.OLD_STAMP  # older than the last


def test_a_flood_of_old_commands_keeps_no_joint_moving() -> None:
    bench = Bench()
    bench.start()
    bench.drive(0.5, 0.4)
    old = bench.command(bench.motion(0.5))
    bench.step(SETTINGS.hold_s)
    before = len(bench.commanded)
    for _ in range(round(1.0 / PERIOD_S)):
        for _ in range(5):
            bench.number += 1
            message = msgspec.structs.replace(old, number=bench.number)
            assert bench.receiver.take(message, bench.state) is not None
        bench.step()
    assert not np.any(bench.commanded[before + round((0.05 + BRAKING_S) / PERIOD_S) :])


def faulty(bench: Bench) -> dict[str, StoppingTrajectory]:
    motion, count = bench.motion(0.2), len(bench.joints.names)
    times, speeds = motion.times_s, motion.speeds
    going_on, late = speeds.copy(), times.copy()
    going_on[-1] = 0.1
    late[-1] += 1.0
    steep = np.vstack([speeds[:2], np.zeros((1, count))])
    return {
        "does not end at rest": StoppingTrajectory(times, going_on),
        "exceeds the joints' speed limits": StoppingTrajectory(times, 10.0 * speeds),
        "exceeds the joints' acceleration limits": StoppingTrajectory(
            np.array([0.0, 0.1, 0.101]), steep
        ),
        "comes to rest after": StoppingTrajectory(late, speeds),
        "must begin at 0 and increase": StoppingTrajectory(times[::-1].copy(), speeds),
        "10 speeds at each": StoppingTrajectory(times, speeds[:, :9]),
        "not finite": StoppingTrajectory(times, np.nan * speeds),
    }


@pytest.mark.parametrize("fault", faulty(Bench()))
def test_a_motion_that_cannot_be_driven_does_not_count(fault: str) -> None:
    bench = Bench()
    motion = faulty(bench)[fault]
    bench.start()
    assert fault in (motion.fault(bench.joints, SETTINGS.hold_s) or "")
    assert bench.receiver.take(bench.command(motion), bench.state) is Refusal.NO_MOTION
    bench.step(0.1)
    assert not np.any(bench.commanded)


@settings(deadline=None)
@given(st.data())
def test_no_limit_is_broken_whatever_comes_whenever(data: st.DataObject) -> None:
    bench, accepted_s = Bench(), None
    bench.start()
    for _ in range(data.draw(st.integers(1, 12))):
        age_s = data.draw(st.floats(-0.01, 0.2))
        stamp_s = bench.state.time_s - age_s
        if bench.take(data.draw(SHARES), stamp_s=stamp_s) is None:
            accepted_s = stamp_s
        bench.step(data.draw(st.sampled_from([0.002, 0.008, 0.05, 0.3])))
    bench.step(0.002)
    if accepted_s is None:
        assert not np.any(bench.commanded)
    else:
        bench.step(max(0.0, accepted_s + 0.15 + BRAKING_S - bench.state.time_s))
        bench.step(0.002)
        assert not bench.commanded[-1].any()
    assert bench.broken_limits() == []


def test_joints_stop_at_their_ends() -> None:
    bench = Bench()
    bench.start()
    for _ in range(40):
        bench.drive(1.0, 0.2)
        if np.all(bench.state.positions > bench.joints.upper - 0.1):
            break
    assert np.all(bench.state.positions <= bench.joints.upper)
    bench.drive(1.0, 0.5)
    assert bench.broken_limits() == []
    assert np.abs(bench.state.velocities[:7]).max() < 0.05


def test_joints_whose_state_is_no_number_brake() -> None:
    bench = Bench()
    bench.start()
    bench.drive(0.3, 0.4)
    state = bench.state
    blind = type(state)(state.time_s, np.full(10, np.nan), state.velocities)
    speeds = [bench.receiver.speeds(blind) for _ in range(round(BRAKING_S / PERIOD_S))]
    assert np.abs(speeds[0]).max() > 0.1
    assert not speeds[-1].any()


def test_joints_whose_clock_stands_brake_and_one_that_runs_back_ends_the_session() -> None:
    bench = Bench()
    bench.start()
    bench.drive(0.3, 0.4)
    stands = bench.state
    speeds = [bench.receiver.speeds(stands) for _ in range(round(BRAKING_S / PERIOD_S) + 1)]
    assert np.abs(speeds[0]).max() > 0.1
    assert not speeds[-1].any()
    earlier = type(stands)(stands.time_s - 0.1, stands.positions, stands.velocities)
    bench.receiver.speeds(earlier)
    assert bench.receiver.phase is Phase.WAITING
    assert bench.receiver.ended == "the arm's clock ran back"


def test_no_session_starts_at_a_time_that_is_no_number() -> None:
    bench = Bench()
    timeless = type(bench.state)(np.nan, bench.state.positions, bench.state.velocities)
    assert bench.receiver.take(Start(bench.receiver.session), timeless) is Refusal.NO_TIME
    assert not bench.receiver.speeds(timeless).any()


def test_messages_are_lines_of_json_that_read_back_equal() -> None:
    bench = Bench()
    message = bench.command(bench.motion(0.123456789))
    line = line_of(message)
    assert line.count(b"\n") == 1
    assert json.loads(line)["type"] == "command"
    assert from_loop(line) == message
    for wrong in (b"", b"{}", b'{"type":"stop"}', b'{"type":"start"}', b"\xff\xfe", b"[" * 9999):
        assert from_loop(wrong) is None
        with pytest.raises(ServoError, match="sent an invalid message"):
            from_driver(wrong)


def test_a_line_that_is_nested_without_end_is_no_message() -> None:
    line = b'{"type":"start","session":"x","y":' + b"[" * 30_000 + b"]" * 30_000 + b"}"
    assert from_loop(line) is None
    with pytest.raises(ServoError, match="sent an invalid message"):
        from_driver(line)

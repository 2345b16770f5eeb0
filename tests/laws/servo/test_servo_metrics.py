"""What a run was worth: laws on logs that are made up."""

import json
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.servo import (
    Command,
    JointState,
    Reason,
    Seen,
    ServoLog,
    ServoMetrics,
    ServoRow,
    Tick,
    holds,
)
from servoid.source import Instant

PERIOD_S = 0.01
START_S = 3.0
HERE = Pose.from_parts([0.3, -0.2, 0.5], [0.5, -0.5, -0.5, 0.5])
CENTERED = np.zeros((2, 2))


def off(millimetres: tuple[float, float, float], degrees: float = 0.0) -> Pose:
    """Make a small motion, with its turn about y."""
    half = np.radians(degrees) / 2.0
    return Pose.from_parts(
        (1e-3 * np.array(millimetres)).tolist(), [np.cos(half), 0.0, np.sin(half), 0.0]
    )


def row_at(number: int, hand: Pose = HERE, goal: Pose | None = HERE, **times: float) -> ServoRow:
    time_s = START_S + PERIOD_S * number
    state = JointState(time_s, np.zeros(2), np.zeros(2))
    command = Command(np.zeros(2), np.zeros(6))
    tick = Tick(state, None, None, command, times.get("control_s", 0.0), times.get("track_s", 0.0))
    return ServoRow(tick, hand, goal, None, None)


def seen_at(row: ServoRow, off_px: NDArray[np.float64], status: str = "tracking") -> ServoRow:
    instant = Instant(0, row.time_s, (HERE, HERE), (None, None))
    estimate = FakeEstimate(row.time_s, HERE, status)
    tick = replace(row.tick, instant=instant, estimate=estimate)  # type: ignore
    return replace(row, tick=tick, seen=Seen(instant, estimate, HERE, off_px))  # type: ignore


def held(row: ServoRow, *reasons: Reason) -> ServoRow:
    command = replace(row.tick.command, holding=frozenset(reasons))
    return replace(row, tick=replace(row.tick, command=command))


def log_of(rows: list[ServoRow]) -> ServoLog:
    log = ServoLog(("a", "b"), START_S)
    for row in rows:
        log.add(row)
    return log


def test_a_constant_error_of_the_hand_is_its_own_rms_and_percentile() -> None:
    rows = [row_at(number, HERE @ off((3.0, 0.0, -4.0), 2.0)) for number in range(50)]
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    assert metrics.position_rms == pytest.approx(0.005)
    assert metrics.position_95 == pytest.approx(0.005)
    assert metrics.turn_rms == pytest.approx(np.radians(2.0))


def test_errors_before_the_hand_has_settled_do_not_count() -> None:
    far, near = HERE @ off((200.0, 0.0, 0.0), 20.0), HERE @ off((0.0, 1.0, 0.0), 0.5)
    rows = [row_at(number, far if number < 20 else near) for number in range(100)]
    rows = [seen_at(row, np.full((2, 2), 90.0)) if row.time_s < 3.195 else row for row in rows]
    rows.append(seen_at(row_at(100, near), np.array([[3.0, 4.0], [0.0, 1.0]])))
    metrics = ServoMetrics.of(log_of(rows), 0.195)
    assert metrics.position_rms == pytest.approx(0.001)
    assert metrics.turn_rms == pytest.approx(np.radians(0.5))
    assert metrics.fixation_rms_px == pytest.approx(np.sqrt((25.0 + 1.0) / 2.0))


def test_the_95th_percentile_is_what_one_error_in_twenty_exceeds() -> None:
    rows = [row_at(number, HERE @ off((number / 10, 0.0, 0.0))) for number in range(1001)]
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    assert metrics.position_95 == pytest.approx(0.095)
    assert metrics.position_rms == pytest.approx(0.1 / np.sqrt(3.0), rel=1e-3)


def test_the_share_of_tracked_observations_leaves_out_searching_and_lost() -> None:
    statuses = ["tracking"] * 6 + ["searching", "lost"]
    rows = [seen_at(row_at(place), CENTERED, status) for place, status in enumerate(statuses)]
    metrics = ServoMetrics.of(log_of([*rows, row_at(9)]), 0.0)
    assert metrics.observations == 8
    assert metrics.tracked_share == metrics.located_share == 0.75


def test_an_object_whose_rotation_is_not_known_is_located_and_not_tracked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(FakeEstimate, "located", property(lambda _one: True))
    rows = [seen_at(row_at(place), CENTERED, "searching") for place in range(4)]
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    assert (metrics.tracked_share, metrics.located_share) == (0.0, 1.0)
    assert metrics.figures()["observations tracked"] == "0.0 % of 4"
    assert metrics.figures()["observations located"].startswith("100 %")


def test_an_observation_without_images_was_not_tracked() -> None:
    row = seen_at(row_at(0), np.full((2, 2), np.nan))
    assert row.seen is not None
    dark = replace(
        row, tick=replace(row.tick, estimate=None), seen=replace(row.seen, estimate=None)
    )
    metrics = ServoMetrics.of(log_of([dark]), 0.0)
    assert metrics.tracked_share == 0.0
    assert np.isnan(metrics.fixation_rms_px) and np.isnan(metrics.track_s.p50)


def test_a_hand_on_a_straight_line_is_as_fast_as_it_goes() -> None:
    rows = [row_at(number, HERE @ off((2.0 * number, 0.0, 0.0))) for number in range(20)]
    assert ServoMetrics.of(log_of(rows), 0.0).fastest_hand == pytest.approx(0.2)


def test_control_is_timed_each_tick_and_the_tracker_only_when_it_worked() -> None:
    rows = [row_at(number, control_s=0.001 * number, track_s=0.0) for number in range(101)]
    rows[40] = seen_at(row_at(40, control_s=0.040, track_s=0.012), CENTERED)
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    assert metrics.control_s.p50 == pytest.approx(0.050)
    assert metrics.control_s.p99 == pytest.approx(0.099)
    assert metrics.track_s.p50 == metrics.track_s.p99 == 0.012


def test_the_time_of_a_control_tick_is_told_beside_the_period_it_may_take() -> None:
    metrics = ServoMetrics.of(log_of([row_at(number, control_s=0.002) for number in range(9)]), 0.0)
    assert metrics.figures()["control tick"] == (
        "median 2.00 ms, 99 % within 2.00 ms, of a period of 10 ms"
    )
    assert ServoMetrics.of(log_of([]), 0.0).figures()["control tick"] == "not known"


@pytest.mark.parametrize(("slow", "is_noted"), [(0, False), (1, False), (20, True), (200, True)])
def test_ticks_longer_than_their_period_are_noted_when_more_than_one_in_a_hundred_is(
    slow: int, is_noted: bool
) -> None:
    rows = [row_at(number, control_s=0.012 if number < slow else 0.002) for number in range(200)]
    note = ServoMetrics.of(log_of(rows), 0.0).late_note()
    assert (note is not None) == is_noted
    assert note is None or "longer than the control period of 10 ms: in the simulation" in note


def test_a_hold_names_its_reasons_in_the_order_in_which_they_came() -> None:
    rows = [row_at(number) for number in range(10)]
    rows[3] = held(rows[3], Reason.LOST)
    rows[4] = held(rows[4], Reason.LOST, Reason.NO_IMAGES)
    rows[5] = held(rows[5], Reason.RETURNING)
    rows[9] = held(rows[9], Reason.TELEPORT)
    first, last = holds(log_of(rows))
    assert first.reasons == (Reason.LOST, Reason.NO_IMAGES, Reason.RETURNING)
    assert (first.start_s, first.end_s) == pytest.approx((0.03, 0.06))
    assert last.reasons == (Reason.TELEPORT,)
    assert last.seconds == pytest.approx(PERIOD_S)


@given(st.lists(st.sampled_from([None, Reason.LOST, Reason.FROZEN]), max_size=40))
def test_holds_are_apart_in_order_and_as_long_as_the_ticks_that_were_held(
    reasons: list[Reason | None],
) -> None:
    rows = [
        row_at(number) if reason is None else held(row_at(number), reason)
        for number, reason in enumerate(reasons)
    ]
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    ticks = sum(reason is not None for reason in reasons)
    # The period of a single tick is not known.
    assert metrics.held_s == pytest.approx(PERIOD_S * ticks if len(reasons) > 1 else 0.0)
    assert all(one.end_s < other.start_s - 1e-9 for one, other in pairwise(metrics.holds))
    for hold in metrics.holds:
        inside = reasons[round(hold.start_s / PERIOD_S) : round(hold.end_s / PERIOD_S)]
        assert set(inside or hold.reasons) == set(hold.reasons)


@pytest.mark.parametrize("rows", [[], [row_at(0, goal=None)]], ids=["empty", "no truth"])
def test_what_a_log_does_not_say_is_not_made_up(rows: list[ServoRow]) -> None:
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    assert np.isnan([metrics.position_rms, metrics.turn_rms, metrics.tracked_share]).all()
    figures = metrics.figures()
    assert figures["repeatability, RMS"] == figures["accuracy, RMS"] == "not known"
    assert figures["hand held"] == "never"


def test_figures_are_in_millimetres_degrees_and_milliseconds() -> None:
    hand = HERE @ off((3.0, 0.0, -4.0), 2.0)
    rows = [seen_at(row_at(one, hand, control_s=0.0004), CENTERED) for one in range(4)]
    rows.append(held(rows.pop(), Reason.LOST))
    figures = ServoMetrics.of(log_of(rows), 0.0).figures()
    assert list(figures.values()) == [
        "5.00 mm, 2.00 deg",
        "5.00 mm",
        *["not known"] * 7,
        "0.00 px",
        "0 s",
        "0.00 mm/s",
        "100 % of 4",
        "100 %, with or without the rotation",
        "once, 0.01 s",
        "median 0.40 ms, 99 % within 0.40 ms, of a period of 10 ms",
        "median 0.00 ms, 99 % within 0.00 ms",
    ]


def test_the_figures_go_through_json_and_what_is_not_known_is_null() -> None:
    rows = [held(row_at(0, goal=None), Reason.LOST), row_at(1, goal=None, control_s=0.002)]
    metrics = ServoMetrics.of(log_of(rows), 0.0)
    numbers = metrics.numbers()
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    repeatability = {"position_rms", "position_95", "turn_rms"}
    names = {field.name for field in fields(metrics)} - repeatability
    assert set(numbers) == names | {"held_s", "repeatability"}
    assert set(numbers["repeatability"]) == repeatability
    assert set(numbers["repeatability"].values()) == set(numbers["accuracy"].values()) == {None}
    assert numbers["track_s"] == {"p50": None, "p99": None}
    assert numbers["holds"][0]["reasons"] == ["lost"]
    assert numbers["held_s"] == pytest.approx(PERIOD_S)


def test_a_log_keeps_no_images() -> None:
    row = seen_at(row_at(0), CENTERED)
    assert row.seen is not None
    images = (np.zeros((4, 4, 3), np.uint8),) * 2
    full = replace(row, seen=replace(row.seen, instant=replace(row.seen.instant, images=images)))
    kept = log_of([full]).rows[0]
    assert kept.tick.instant is None
    assert kept.seen is not None and kept.seen.instant.images == ()

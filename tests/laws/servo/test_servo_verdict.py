"""A servo run is rated by one rule: laws on logs that are made up."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_servo_metrics import CENTERED, HERE, PERIOD_S, held, log_of, off, row_at, seen_at
from tiers import tiered

from servoid.pose import Pose
from servoid.servo import Reason, ServoLog, ServoMetrics, ServoRow, TrueGoal, verdict_of
from servoid.servo.verdict import BOUNDS

COUNT = 200
PAGE = Path(__file__).parents[3] / "docs" / "howto" / "report.md"
POINT = np.zeros((1, 3))


def run(
    millimetres: float = 1.0, degrees: float = 0.2, true_mm: float = 2.0, true_deg: float = 0.2
) -> list[ServoRow]:
    """Return a run of constant errors relative to the body, and relative to the true object."""
    hand = HERE @ off((millimetres, 0.0, 0.0), degrees)
    hand_from_object = off((true_mm, 0.0, 0.0), true_deg).inverse()
    rows = [seen_at(row_at(number, hand), CENTERED) for number in range(COUNT)]
    return [replace(row, hand_from_object=hand_from_object) for row in rows]


def logged(rows: list[ServoRow]) -> ServoLog:
    log = log_of(rows)
    log.true_goal = TrueGoal(Pose.identity(), POINT[0], POINT, POINT, POINT[0], POINT)
    return log


def limited(row: ServoRow, *reasons: Reason) -> ServoRow:
    command = replace(row.tick.command, limiting=frozenset(reasons))
    return replace(row, tick=replace(row.tick, command=command))


def unlocated(row: ServoRow, status: str) -> ServoRow:
    return seen_at(replace(row, seen=None), CENTERED, status)


def rating(rows: list[ServoRow], settle_s: float = 0.5, ending: str | None = None) -> str:
    log = logged(rows)
    return verdict_of(log, ServoMetrics.of(log, settle_s), ending).words


def test_a_run_within_all_bounds_is_good_and_no_reason_is_given() -> None:
    assert rating(run()) == "good"


@pytest.mark.parametrize(
    ("errors", "word", "reason"),
    [
        ({"millimetres": 5.5}, "rough", "repeatability 5.50 mm RMS, above 5 mm"),
        ({"millimetres": 15.5}, "poor", "repeatability 15.50 mm RMS, above 15 mm"),
        ({"true_mm": 12.5}, "rough", "accuracy 12.50 mm RMS, above 12 mm"),
        ({"true_mm": 30.5}, "poor", "accuracy 30.50 mm RMS, above 30 mm"),
        ({"true_deg": 1.1}, "rough", "rotation 1.10 degrees RMS, above 1 degree"),
        ({"true_deg": 3.1}, "poor", "rotation 3.10 degrees RMS, above 3 degrees"),
    ],
)
def test_an_error_above_a_bound_is_named(errors: dict[str, float], word: str, reason: str) -> None:
    assert rating(run(**errors)) == f"{word}: {reason}"


def test_errors_before_the_hand_has_settled_make_no_run_worse() -> None:
    far = HERE @ off((200.0, 0.0, 0.0))
    rows = [replace(row, world_from_hand=far) for row in run()[:40]] + run()[40:]
    assert rating(rows) == "good"
    assert rating(rows, settle_s=0.3).startswith("poor: repeatability ")


@pytest.mark.parametrize(("count", "word"), [(10, "rough"), (30, "poor")])
def test_a_run_in_which_the_hand_was_held_is_not_good(count: int, word: str) -> None:
    rows = run()
    rows[60 : 60 + count] = [held(row, Reason.UNSURE) for row in rows[60 : 60 + count]]
    assert rating(rows) == f"{word}: the hand was held for {PERIOD_S * count:.1f} of 2.0 s"


def test_a_run_that_ends_with_the_hand_held_is_poor() -> None:
    rows = run()
    rows[-1] = held(rows[-1], Reason.LOST)
    assert rating(rows) == "poor: the hand was held for 0.0 of 2.0 s, to the end"


@pytest.mark.parametrize(
    ("place", "count", "status", "word", "reason"),
    [
        (50, 1, "lost", "rough", "the object was lost in 1 of 200 observations"),
        (50, 9, "searching", "good", ""),
        (50, 11, "searching", "rough", "the object was tracked in 94 % of 200 observations"),
        (0, 61, "searching", "poor", "the object was tracked in 69 % of 200 observations"),
        (199, 1, "lost", "poor", "the object was lost in 1 of 200 observations, and at the end"),
    ],
)
def test_a_run_that_lost_its_object_is_not_good(
    place: int, count: int, status: str, word: str, reason: str
) -> None:
    rows = run()
    part = slice(place, place + count)
    rows[part] = [unlocated(row, status) for row in rows[part]]
    assert rating(rows) == (f"{word}: {reason}" if reason else word)


def test_a_run_that_was_kept_from_its_goal_is_not_good_unless_it_was_by_quick_motion() -> None:
    slow = [limited(row, Reason.WORKSPACE) for row in run()]
    words = "a limit kept the hand from its goal for 1.50 of 1.50 s after settling"
    assert rating(slow) == f"rough: {words}"
    assert rating([limited(row, Reason.HAND_SPEED) for row in run()]) == "good"
    assert rating([limited(row, Reason.AWAY) for row in run()[:50]] + run()[50:]) == "good"


@pytest.mark.parametrize("doubt", [Reason.ROUGH, Reason.PARTED, Reason.UNSEEN])
def test_a_doubtful_goal_is_not_taken_for_a_limit_of_the_hand(doubt: Reason) -> None:
    words = "the goal was in doubt for 1.50 of 1.50 s after settling"
    assert rating([limited(row, doubt) for row in run()]) == f"rough: {words}"


def test_a_hand_that_stays_on_its_way_is_not_taken_for_a_limited_one() -> None:
    words = "the hand was on its way to its goal for 1.50 of 1.50 s after settling"
    assert rating([limited(row, Reason.AWAY) for row in run()]) == f"rough: {words}"


def test_a_run_without_an_observation_is_poor() -> None:
    assert rating([replace(row, seen=None) for row in run()]) == "poor: no observation came"


def test_an_interrupted_run_is_not_good_and_says_so_first() -> None:
    ending = "interrupted after 1.99 of 4 s of servoing"
    assert rating(run(), ending=ending) == f"rough: {ending}"
    assert rating(run(true_mm=40.0), ending=ending).startswith(f"poor: {ending}; accuracy 40.00")


@pytest.mark.parametrize(
    ("rows", "settle_s", "why"),
    [
        (run(), 3.0, "servoing ended after 2.0 s, and errors count after 3 s"),
        ([replace(row, world_from_goal=None) for row in run()], 0.5, "the hand had no goal after "),
        (run(), 1.985, "servoing ended after 2.0 s, and errors count after 1.985 s"),
        ([], 0.0, "servoing did not begin"),
    ],
)
def test_a_run_whose_errors_are_unknown_is_never_good(
    rows: list[ServoRow], settle_s: float, why: str
) -> None:
    words = rating(rows, settle_s)
    assert words.startswith(f"unknown: the errors of the hand are unknown: {why}")
    if rows:
        rows = [held(row, Reason.NO_IMAGES) for row in rows]
        assert rating(rows, settle_s).startswith("poor: the errors of the hand are unknown: ")


def test_the_page_on_reports_states_the_bounds_of_the_rule() -> None:
    text = " ".join(PAGE.read_text(encoding="utf-8").split())
    part = text[text.index("## The report of a servo run") :]
    for bound in BOUNDS:
        good, rough = map(bound.in_words, (bound.good, bound.rough))
        assert re.search(rf"\| {bound.name}[^|]* \| {good} \| {rough} \|", part), bound


@pytest.mark.parametrize(
    ("settle_s", "is_marked"), tiered([(0.3, True), (0.0, False), (5.0, False)])
)
def test_the_plots_of_errors_mark_the_time_from_which_they_count(
    settle_s: float, is_marked: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib", reason="plots need matplotlib")
    from matplotlib.axes import Axes

    from servoid.view import draw_servo_plots
    from servoid.view.servo.servo_plots import gaze_panels, hand_panels

    marked: list[float] = []
    monkeypatch.setattr(Axes, "axvline", lambda _axes, x, **_options: marked.append(x))
    log = logged(run())
    draw_servo_plots(log, tmp_path, settle_s=settle_s)
    panels = len(hand_panels(log, settle_s)) + len(gaze_panels(log, settle_s))
    assert marked == [settle_s] * (panels if is_marked else 0)

"""Limits of the hand, doubts of its goal and the way to it are told apart, with one duration."""

import re
from pathlib import Path

import pytest
from test_servo_metrics import PERIOD_S
from test_servo_verdict import COUNT, limited, logged, rating, run

from servoid.servo import ORDINARY, GoalTimes, LimitingKind, Reason, ServoLog, ServoRow
from servoid.view import ServoPictures, write_servo_report

SETTLE_S = 0.5
SAID = {
    LimitingKind.LIMITED: Reason.WORKSPACE,
    LimitingKind.DOUBTED: Reason.ROUGH,
    LimitingKind.AWAY: Reason.AWAY,
}


def with_reason(reason: Reason, first: int = 0) -> list[ServoRow]:
    return [*run()[:first], *(limited(row, reason) for row in run()[first:])]


def test_what_any_quick_motion_reaches_is_in_no_row() -> None:
    quick = [limited(row, *ORDINARY) for row in run()]
    assert not dict(GoalTimes.of(logged(quick), SETTLE_S).rows())


def test_doubts_of_the_goal_are_no_limits() -> None:
    doubts = {reason for reason in Reason if LimitingKind.of(reason) is LimitingKind.DOUBTED}
    assert doubts == {Reason.ROUGH, Reason.PARTED, Reason.UNSEEN}


@pytest.mark.parametrize(("kind", "reason"), SAID.items())
def test_a_verdict_has_the_duration_of_the_row_that_says_the_same(
    kind: LimitingKind, reason: Reason, tmp_path: Path
) -> None:
    rows = with_reason(reason, first=80)
    times = GoalTimes.of(logged(rows), SETTLE_S)
    lasted = times.in_words(PERIOD_S * (COUNT - 80))
    assert lasted == "1.20 of 1.50 s after settling"
    assert dict(times.rows()) == {kind.value: f"{reason.value}, for {lasted}"}
    assert rating(rows, SETTLE_S).endswith(f" for {lasted}")
    page = write_servo_report(tmp_path, logged(rows), {}, ServoPictures(), settle_s=SETTLE_S)
    text = re.sub("<.*?>", "", page.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " "))
    assert text.count(lasted) == (3 if kind is LimitingKind.LIMITED else 2)
    assert set(re.findall(r"[\d.]+ of [\d.]+ s", text)) == {"1.20 of 1.50 s"}


def test_what_ends_before_the_hand_has_settled_is_in_no_row() -> None:
    early = [limited(row, Reason.AWAY, Reason.ROUGH) for row in run()[:50]]
    assert not dict(GoalTimes.of(logged([*early, *run()[50:]]), SETTLE_S).rows())


def test_of_a_run_that_ends_before_the_hand_has_settled_the_whole_counts() -> None:
    times = GoalTimes.of(logged(with_reason(Reason.UNREACHABLE)), 5.0)
    assert not times.settled
    assert times.whole_s == pytest.approx(PERIOD_S * COUNT)
    assert times.in_words(times.by_kind[LimitingKind.LIMITED]) == "2.00 of 2.00 s"
    main = times.main_limit()
    assert main is not None and main[0] is Reason.UNREACHABLE


def test_two_reasons_of_a_kind_at_once_count_once_for_the_kind() -> None:
    both = [limited(row, Reason.ROUGH, Reason.UNSEEN, Reason.JOINT_JERK) for row in run()]
    times = GoalTimes.of(logged(both), SETTLE_S)
    assert set(times.by_reason) == {Reason.ROUGH, Reason.UNSEEN}
    assert times.by_kind[LimitingKind.DOUBTED] == pytest.approx(times.whole_s)
    assert times.main_limit() is None


def test_a_log_without_rows_has_no_times() -> None:
    times = GoalTimes.of(ServoLog(("a",)))
    assert (times.whole_s, times.settled, times.by_reason) == (0.0, False, {})


def test_limits_and_doubts_that_are_brief_alone_count_together_in_the_verdict() -> None:
    rows = run()
    brief = int(0.04 * (COUNT - SETTLE_S / PERIOD_S))  # each below the bound of 5 %
    rows[60 : 60 + brief] = [limited(row, Reason.WORKSPACE) for row in rows[60 : 60 + brief]]
    alone = rating(rows, SETTLE_S)
    rows[90 : 90 + brief] = [limited(row, Reason.ROUGH) for row in rows[90 : 90 + brief]]
    together = rating(rows, SETTLE_S)
    assert alone == "good"
    assert together.startswith("rough: a limit kept the hand from its goal for 0.0")
    assert "; the goal was in doubt for 0.0" in together

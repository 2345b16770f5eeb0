"""Rates a servo run in a word, with the reasons; page and terminal use this one rule."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from servoid.servo.goal_times import GoalTimes, LimitingKind
from servoid.servo.log import ServoLog
from servoid.servo.metrics import ServoMetrics

_WORDS = ("good", "rough", "poor")
_GOOD, _ROUGH, _POOR = range(len(_WORDS))
_UNKNOWN = "unknown"
_LEAST_PERIODS = 3  # periods of control, after the hand had time to settle, that errors are of


@dataclass(frozen=True)
class Bound:
    """The greatest value for `good` and for `rough`, in a unit for people."""

    name: str
    unit: str
    good: float
    rough: float

    def level(self, value: float) -> int:
        """Return the index of the word for a value; one that is not known makes no run worse."""
        return _POOR if value > self.rough else _ROUGH if value > self.good else _GOOD

    def in_words(self, value: float) -> str:
        """Return one of the two bounds with its unit."""
        return f"{value:g} {self.unit.removesuffix('s') if value == 1.0 else self.unit}"


# Good is what docs/servoing.md measured of printed objects in images of 640 x 480.
_REPEATABILITY = Bound("repeatability", "mm", 5.0, 15.0)
_ACCURACY = Bound("accuracy", "mm", 12.0, 30.0)
_ROTATION = Bound("rotation", "degrees", 1.0, 3.0)
_HELD = Bound("held", "%", 0.0, 10.0)
_NOT_TRACKED = Bound("not tracked", "%", 5.0, 100.0)
_NOT_LOCATED = Bound("not located", "%", 5.0, 30.0)
# Of the time after the hand had time to settle, all kinds together.
_AMISS = Bound("kept from its goal", "%", 5.0, 100.0)
_AMISS_WORDS = {
    LimitingKind.LIMITED: "a limit kept the hand from its goal",
    LimitingKind.DOUBTED: "the goal was in doubt",
    LimitingKind.AWAY: "the hand was on its way to its goal",
}
BOUNDS = (_REPEATABILITY, _ACCURACY, _ROTATION, _HELD, _NOT_TRACKED, _NOT_LOCATED, _AMISS)
"""All bounds of the rule, as docs/howto/report.md has them."""

_Reasons = Iterator[tuple[int, str]]


@dataclass(frozen=True)
class ServoVerdict:
    """The rating of a run: `word` is good, rough, poor or unknown; `reasons` say why not good."""

    word: str
    reasons: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Return the word and, if there are any, the reasons."""
        return f"{self.word}: {'; '.join(self.reasons)}" if self.reasons else self.word


def verdict_of(log: ServoLog, metrics: ServoMetrics, ending: str | None = None) -> ServoVerdict:
    """Rate a run by its log and the metrics of that: by its errors, and by what went wrong.

    The worst figure decides. `ending` says why the run is not finished: then it is not good. A run
    whose errors are unknown is poor if anything else is, and otherwise unknown.
    """
    unknown = why_errors_unknown(log, metrics.settle_s)
    found = [] if ending is None else [(_ROUGH, ending)]
    if unknown is None:
        found += _errors(metrics)
    else:
        found.append((_GOOD, f"the errors of the hand are unknown: {unknown}"))
    found += [*_holds(log, metrics), *_observations(log, metrics), *_amiss(log, metrics.settle_s)]
    worst = max((level for level, _ in found), default=_GOOD)
    word = _WORDS[worst] if unknown is None or worst == _POOR else _UNKNOWN
    return ServoVerdict(word, tuple(reason for _, reason in found))


def why_errors_unknown(log: ServoLog, settle_s: float) -> str | None:
    """Return why the errors of the hand are unknown; None if they are known."""
    if not len(log):
        return "servoing did not begin"
    lasted_s = float(log.times[-1])
    later = [row for row in log.rows if row.time_s - log.start_s >= settle_s]
    if len(later) < _LEAST_PERIODS:
        return f"servoing ended after {lasted_s:.1f} s, and errors count after {settle_s:g} s"
    if all(row.world_from_goal is None for row in later):
        return f"the hand had no goal after {settle_s:g} s of servoing"
    return None


def _errors(metrics: ServoMetrics) -> _Reasons:
    true = metrics.accuracy
    turn = metrics.turn_rms if np.isnan(true.turn_rms) else true.turn_rms
    for bound, value in (
        (_REPEATABILITY, 1e3 * metrics.position_rms),
        (_ACCURACY, 1e3 * true.position_rms),
        (_ROTATION, float(np.degrees(turn))),
    ):
        level = bound.level(value)
        if level != _GOOD:
            most = bound.in_words(bound.good if level == _ROUGH else bound.rough)
            yield level, f"{bound.name} {value:.2f} {bound.unit} RMS, above {most}"


def _holds(log: ServoLog, metrics: ServoMetrics) -> _Reasons:
    if not metrics.holds:
        return
    lasted_s = float(log.periods_s.sum())
    level = _HELD.level(100.0 * metrics.held_s / lasted_s) if lasted_s > 0.0 else _POOR
    words = f"the hand was held for {metrics.held_s:.1f} of {lasted_s:.1f} s"
    if log.rows[-1].tick.command.holding:
        yield _POOR, f"{words}, to the end"
    else:
        yield max(level, _ROUGH), words


def _observations(log: ServoLog, metrics: ServoMetrics) -> _Reasons:
    """Rate how often the object was lost, not tracked and not located."""
    estimates = [seen.estimate for _, seen in log.seen]
    if log.rows and not estimates:
        yield _POOR, "no observation came"
        return
    lost = [one is not None and one.status == "lost" for one in estimates]
    if any(lost):
        at_end = ", and at the end" if lost[-1] else ""
        words = f"the object was lost in {sum(lost)} of {len(lost)} observations{at_end}"
        yield _POOR if lost[-1] else _ROUGH, words
    level = max(
        _NOT_TRACKED.level(100.0 * (1.0 - metrics.tracked_share)),
        _NOT_LOCATED.level(100.0 * (1.0 - metrics.located_share)),
    )
    if level != _GOOD:
        tracked, located = map(_percent, (metrics.tracked_share, metrics.located_share))
        more = f" and located in {located} %" if located > tracked else ""
        yield level, f"the object was tracked in {tracked} %{more} of {len(estimates)} observations"


def _percent(share: float) -> int:
    """Return a share in percent, rounded down: none below a bound may look like the bound."""
    return int(100.0 * share + 1e-9)


def _amiss(log: ServoLog, settle_s: float) -> _Reasons:
    """Rate for how long a limit acted, the goal was in doubt, and the hand was on its way to it."""
    times = GoalTimes.of(log, settle_s)
    if not times.settled or not times.whole_s > 0.0:
        return
    if _AMISS.level(100.0 * times.amiss_s / times.whole_s) == _GOOD:
        return
    for kind, seconds in times.by_kind.items():
        if seconds > 0.0:
            yield _ROUGH, f"{_AMISS_WORDS[kind]} for {times.in_words(seconds)}"

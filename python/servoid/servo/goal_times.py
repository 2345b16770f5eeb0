"""Adds up for how long something was amiss with the hand and its goal: limits, doubts, its way."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from servoid.servo.keeping.safety import DOUBTING, ORDINARY, Reason
from servoid.servo.log import ServoLog

_AS_LONG = 0.5  # of the time of the longest one, from which on an unreachable goal is the cause


class LimitingKind(Enum):
    """What a reason in `limiting` says; the value is its name in the summary and on the page.

    Limits that any quick motion reaches, `ORDINARY`, are left out there.
    """

    LIMITED = "limited by"
    DOUBTED = "goal in doubt"
    AWAY = "off its goal"

    @classmethod
    def of(cls, reason: Reason) -> "LimitingKind":
        """Return the kind of a reason."""
        if reason in DOUBTING:
            return cls.DOUBTED
        return cls.AWAY if reason is Reason.AWAY else cls.LIMITED


@dataclass(frozen=True)
class GoalTimes:
    """For how long the hand was limited, its goal was in doubt, and it was on its way, in seconds.

    Only the time after `settle_s` seconds of servoing counts, which is `whole_s` long; of a run
    that is not longer, the whole counts, and `settled` is false. `by_reason` lists what occurred,
    by name; `by_kind` is the time with any reason of a kind, `amiss_s` that with any at all.
    """

    whole_s: float
    settled: bool
    by_reason: dict[Reason, float]
    by_kind: dict[LimitingKind, float]
    amiss_s: float

    @classmethod
    def of(cls, log: ServoLog, settle_s: float = 0.0) -> "GoalTimes":
        """Add up the times of a log."""
        counted = log.times >= settle_s
        settled = bool(counted.any())
        periods = np.where(counted | (not settled), log.periods_s, 0.0)
        reasons: dict[Reason, float] = {}
        kinds = dict.fromkeys(LimitingKind, 0.0)
        amiss_s = 0.0
        for row, seconds in zip(log.rows, periods.tolist(), strict=True):
            if not seconds > 0.0:
                continue
            found = row.tick.command.limiting - ORDINARY
            amiss_s += seconds if found else 0.0
            for reason in found:
                reasons[reason] = reasons.get(reason, 0.0) + seconds
            for kind in {LimitingKind.of(reason) for reason in found}:
                kinds[kind] += seconds
        ordered = sorted(reasons.items(), key=lambda one: one[0].value)
        return cls(float(periods.sum()), settled, dict(ordered), kinds, amiss_s)

    def reasons(self, kind: LimitingKind) -> dict[Reason, float]:
        """Return the seconds of each reason of a kind."""
        return {one: times for one, times in self.by_reason.items() if LimitingKind.of(one) is kind}

    def main_limit(self) -> tuple[Reason, float] | None:
        """Return the limit that acted longest, and its seconds; None if none acted.

        A goal that is out of reach makes other limits act as well; it is named before them.
        """
        limits = self.reasons(LimitingKind.LIMITED)
        if not limits:
            return None
        most = max(limits, key=lambda reason: limits[reason])
        if limits.get(Reason.UNREACHABLE, 0.0) >= _AS_LONG * limits[most]:
            most = Reason.UNREACHABLE
        return most, limits[most]

    def in_words(self, seconds: float) -> str:
        """Describe a part of the time that counts."""
        after = " after settling" if self.settled else ""
        return f"{seconds:.2f} of {self.whole_s:.2f} s{after}"

    def rows(self) -> Iterator[tuple[str, str]]:
        """Yield what occurred, kind by kind: its name, and the reasons with their times."""
        for kind in LimitingKind:
            reasons = self.reasons(kind)
            if reasons:
                words = (
                    f"{one.value}, for {self.in_words(times)}" for one, times in reasons.items()
                )
                yield kind.value, "; ".join(words)


def limited_s(log: ServoLog, settle_s: float = 0.0) -> dict[Reason, float]:
    """Return the seconds of each limit that kept the hand from its goal, as `GoalTimes` counts."""
    return GoalTimes.of(log, settle_s).reasons(LimitingKind.LIMITED)


def main_limit(log: ServoLog, settle_s: float = 0.0) -> tuple[Reason, float] | None:
    """Return the limit that acted longest, and its seconds; None if none kept the hand back."""
    return GoalTimes.of(log, settle_s).main_limit()

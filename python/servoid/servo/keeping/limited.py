"""Computes for how long each bound kept the hand from its goal."""

from servoid.servo.keeping.safety import ORDINARY, Reason
from servoid.servo.log import ServoLog

_AS_LONG = 0.5  # of the time of the longest one, from which on an unreachable goal is the cause


def limited_s(log: ServoLog) -> dict[Reason, float]:
    """Return the seconds in which each bound acted, except those that any quick motion reaches."""
    found: dict[Reason, float] = {}
    for row, seconds in zip(log.rows, log.periods_s.tolist(), strict=True):
        for reason in row.tick.command.limiting - ORDINARY:
            found[reason] = found.get(reason, 0.0) + seconds
    return dict(sorted(found.items(), key=lambda one: one[0].value))


def main_limit(log: ServoLog) -> tuple[Reason, float] | None:
    """Return the bound that acted longest, and its seconds; None if none kept the hand back.

    A goal that is out of reach makes other bounds act as well; it is named before them.
    """
    limits = limited_s(log)
    if not limits:
        return None
    most = max(limits, key=lambda reason: limits[reason])
    if limits.get(Reason.UNREACHABLE, 0.0) >= _AS_LONG * limits[most]:
        most = Reason.UNREACHABLE
    return most, limits[most]

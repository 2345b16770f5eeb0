"""Computes for how long each bound kept the hand from its goal."""

from servoid.servo.keeping.safety import ORDINARY, Reason
from servoid.servo.log import ServoLog


def limited_s(log: ServoLog) -> dict[Reason, float]:
    """Return the seconds in which each bound acted, except those that any quick motion reaches."""
    found: dict[Reason, float] = {}
    for row, seconds in zip(log.rows, log.periods_s.tolist(), strict=True):
        for reason in row.tick.command.limiting - ORDINARY:
            found[reason] = found.get(reason, 0.0) + seconds
    return dict(sorted(found.items(), key=lambda one: one[0].value))

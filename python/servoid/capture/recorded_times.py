"""Compares the times of a capture with its rate, and names the unit that wrong ones may be in."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from statistics import median

from servoid.camera import VideoFacts
from servoid.errors import CaptureError
from servoid.words import are, counted, measured

_UNITS = (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9))
_UNIT_OFF = 1.5  # factor between the rate and times of another unit; dropped images lengthen steps
_RATE_OFF = 0.05  # of a video, whose own times are not used
_TIMES_OFF = 0.25  # of times that are used whatever the rate is; those of a live source vary
# Without a rate, they may be photographs, taken at any time: only steps that are even, and those of
# a usual camera in another unit, are doubtful. Its rate is none whose steps one would choose.
_USUAL_HZ = (15.0, 24.0, 25.0, 30.0, 60.0)
_USUAL_OFF = 0.02
_LONG_S = 20.0
_EVEN = 0.2
_LEAST_EVEN = 10  # observations


def times_notes(path: Path, times_s: Sequence[float], rate_hz: float | None) -> Iterator[str]:
    """Report times, read from the file `path`, that are doubtful for observations of a rate.

    `times_s` are the times in their order, in seconds; those of a recording, which has a rate,
    should increase.

    Raises:
        CaptureError: the observations are a recording, of `rate_hz` a second, and most times do
            not increase or are in another unit than seconds.

    """
    if len(times_s) < 2:
        return
    steps = [after - before for before, after in pairwise(times_s)]
    step_s = median(steps)
    late = sum(step <= 0.0 for step in steps)
    if step_s <= 0.0:
        if rate_hz is not None:
            raise CaptureError(f"{path}: {unordered_times(times_s)}")
        return
    if late and rate_hz is not None:
        first = next(index for index, step in enumerate(steps) if step <= 0.0)
        yield (
            f"{path}: {counted(late, 'time is', 'times are')} not later than the one before, the "
            f"first that of observation {first + 1} (counted from 0); put the lines in the order "
            "of time, and give each observation a time of its own"
        )
    unit = _unit_of(step_s, steps, rate_hz)
    if unit is not None:
        told = (
            f"{path}: the times are {measured(step_s)} s apart (median)"
            + ("" if rate_hz is None else f", but rate_hz is {measured(rate_hz)}")
            + f"; if they are {unit[0]}, divide them by {unit[1]:.0f}, as time_s is in seconds"
        )
        if rate_hz is not None:
            raise CaptureError(f"{told}, or correct rate_hz")
        yield told
    elif rate_hz is not None:
        note = _rate_note(rate_hz, 1.0 / step_s, f"by its times {path}", by_times=True)
        if note is not None:
            yield note


def unordered_times(times_s: Sequence[float]) -> str | None:
    """Describe times of which most do not increase, and how to write them; None if most do."""
    steps = [after - before for before, after in pairwise(times_s)]
    if not steps or median(steps) > 0.0:
        return None
    late = sum(step <= 0.0 for step in steps)
    if min(times_s) == max(times_s):
        given = f"all {len(times_s)} times are {measured(times_s[0])}"
    elif times_s[-1] < times_s[0] and late == len(times_s) - 1:
        given = f"the times decrease, from {times_s[0]:.10g} to {times_s[-1]:.10g}"
    else:
        given = f"{late} of {len(times_s)} times {are(late)} not later than the one before"
    return (
        f"{given}; in time_s, write the seconds at which each observation was taken, in "
        "increasing order and with their decimals"
    )


def video_rate_note(path: Path, facts: VideoFacts, rate_hz: float) -> str | None:
    """Report a video, the file `path`, whose own rate is not the `rate_hz` of its capture."""
    own_hz = facts.rate_hz
    if facts.times_s is not None and len(facts.times_s) > 1:
        own_hz = 1.0 / median(after - before for before, after in pairwise(facts.times_s))
    if own_hz is None:
        return None
    note = _rate_note(rate_hz, own_hz, f"{path} itself", by_times=False)
    return None if note is None else f"{note}, unless it is slow motion or time lapse"


def _rate_note(rate_hz: float, own_hz: float, whose: str, *, by_times: bool) -> str | None:
    if abs(own_hz - rate_hz) <= (_TIMES_OFF if by_times else _RATE_OFF) * rate_hz:
        return None
    used = "the times are" if by_times else "rate_hz is"
    return (
        f"rate_hz is {measured(rate_hz)}, but {whose} has {measured(own_hz)} observations per "
        f"second (median); {used} used, and speeds follow from it: correct what is wrong"
    )


def _unit_of(
    step_s: float, steps: Sequence[float], rate_hz: float | None
) -> tuple[str, float] | None:
    """Return the unit that the times are probably in, and how many make a second; None if none."""
    if rate_hz is not None:
        for name, per_s in _UNITS:
            if 1.0 / _UNIT_OFF < step_s * rate_hz / per_s < _UNIT_OFF:
                return name, per_s
        return None
    inside = sum(abs(step - step_s) <= _EVEN * step_s for step in steps)
    if step_s < _LONG_S or len(steps) < _LEAST_EVEN or inside < 0.9 * len(steps):
        return None
    for unit in _UNITS:
        if any(abs(step_s * usual / unit[1] - 1.0) <= _USUAL_OFF for usual in _USUAL_HZ):
            return unit
    return None

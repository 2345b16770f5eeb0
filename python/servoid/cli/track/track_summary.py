"""The summary of a track, at most 80 columns wide except for paths."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import typer

from servoid.cli.rows import Row, wrapped
from servoid.cli.source.footage import Footage, LiveFootage
from servoid.model import NO_METRES
from servoid.source import ASSUMED_HZ
from servoid.track import Gap, TrackResult
from servoid.words import counted

_LABEL_WIDTH = 12
_VALUE_WIDTH = 80 - len("  ") - _LABEL_WIDTH - len(" ")
_MOST_GAPS = 4
_MOST_NOTICES = 3
_MS_PER_S = 1e3
_TIMELESS = (
    f"the capture has no times: {ASSUMED_HZ:g} observations per second are assumed; if the rate "
    "is another, write it into its capture.toml as rate_hz"
)

_wrapped = partial(wrapped, width=_VALUE_WIDTH)


def print_track_summary(
    source: str,
    footage: Footage,
    results: Sequence[TrackResult],
    files: Sequence[tuple[str, Path]],
    lacking: Sequence[str] = (),
) -> None:
    """Print how well and how fast each object was tracked, and where the files are.

    `lacking` lists what is missing in files that were written in the background.
    """
    count, capture = len(results[0]), footage.capture
    cameras = counted(len(capture.cameras), "camera")
    typer.echo(f"Tracked {source}: {counted(count, 'observation')}, {cameras}")
    for result in results:
        if len(results) > 1:
            typer.echo(f" {result.name}")
        _print(_rows(result))
    if isinstance(footage, LiveFootage):
        _print(_live_rows(footage, count))
    for note in (*notes_on(footage), *lacking):
        _print(_wrapped("note", note))
    for note in footage.notes:
        _print(_wrapped("assumed", note))
    for kind, path in files:
        typer.echo(f"  {kind:<{_LABEL_WIDTH}} {path}")


def notes_on(footage: Footage) -> list[str]:
    """Return the notes on the images: their times, their scale, and how they were read."""
    capture = footage.capture
    is_timeless = capture.times_s is None and capture.rate_hz is None
    return [
        *([_TIMELESS] if is_timeless and not isinstance(footage, LiveFootage) else []),
        *([] if capture.metric else [NO_METRES]),
        *capture.notes,
    ]


def _live_rows(footage: LiveFootage, count: int) -> Iterator[Row]:
    """Report when time 0 was, and how many observations were dropped."""
    yield "time 0", f"{footage.began:%Y-%m-%d %H:%M:%S} UTC"
    if footage.missed:
        came = count + footage.missed
        share = f"{100.0 * footage.missed / came:.0f} %"
        yield from _wrapped(
            "came", f"{came} observations; {share} were dropped while others were tracked"
        )


def _print(rows: Iterator[Row]) -> None:
    for label, value in rows:
        typer.echo(f"  {label:<{_LABEL_WIDTH}} {value}")


def _rows(result: TrackResult) -> Iterator[Row]:
    reasons = result.reasons
    why = f": {'; '.join(reasons)}" if reasons else ""
    yield from _wrapped("verdict", f"{result.verdict}{why}")
    share = 100.0 * result.tracked_share
    yield "tracked", f"{share:.1f} % ({result.tracked_count} of {len(result)})"
    yield from _wrapped("not tracked", _gaps(result.gaps))
    if result.nowhere is not None:
        yield from _wrapped("note", result.nowhere)
    if result.gone is not None:
        yield from _wrapped("note", result.gone)
    fits = "" if result.overlap is None else f", silhouette IoU {result.overlap:.2f}"
    parts = counted(len(result.body), "ellipsoid")
    first = "" if result.evolutions else f", {parts}"
    yield "start", f"{result.starting_s:.2f} s to the first pose{first}{fits}"
    if len(result) > 1:
        yield from _speed(result)
    if result.evolutions:
        times = counted(result.evolutions, "time")
        yield "evolved", f"{times}, in the background, to {parts}"
    notices = result.notices
    for notice, times in notices[:_MOST_NOTICES]:
        yield from _wrapped("notice", f"{notice}{f' ({times} of this kind)' if times > 1 else ''}")
    if len(notices) > _MOST_NOTICES:
        yield "", f"and {counted(len(notices) - _MOST_NOTICES, 'other kind')} of notice"
    for note in result.notes:
        yield from _wrapped("at first", note)


def _speed(result: TrackResult) -> Iterator[Row]:
    """Report how fast the steps were, without reading and undistorting images."""
    yield "rate", f"{result.rate_hz:.0f} observations per second (the tracker alone)"
    marks = [
        f"{name} {_MS_PER_S * result.step_percentile(percent):.2f}"
        for name, percent in (("median", 50.0), ("p95", 95.0), ("p99", 99.0))
    ]
    yield "ms a step", ", ".join(marks)
    stages = result.stage_seconds
    if sum(stages.values()) > 0.0:
        parts = [f"{stage} {_MS_PER_S * seconds:.2f}" for stage, seconds in stages.items()]
        mean = f"mean {_MS_PER_S * sum(stages.values()):.2f}"
        yield from _wrapped("on average", f"{mean}: {', '.join(parts)}")
    yield "hypotheses", f"{result.evaluations:.0f} per step"


def _gaps(gaps: Sequence[Gap]) -> str:
    """List the gaps in tracking, the longest ones if there are many."""
    longest = sorted(gaps, key=lambda gap: -gap.count)[:_MOST_GAPS]
    words = [_gap(one) for one in sorted(longest, key=lambda gap: gap.first_s)]
    if len(gaps) > len(longest):
        words.append(f"and {len(gaps) - len(longest)} more")
    return ", ".join(words)


def _gap(gap: Gap) -> str:
    """Say when an object was not tracked, and in how many observations: times look like spans."""
    when = f"at {gap.first_s:.2f} s"
    if gap.count > 1:
        when = f"{gap.first_s:.2f} to {gap.last_s:.2f} s"
    return f"{when} ({counted(gap.count, 'observation')})"

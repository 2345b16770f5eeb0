"""What came of the future work that the paper names: several ellipsoids, and all six freedoms."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.findings import Finding, Section, Table, Verdict
from servoid_experiments.paper.intervals import Interval, interval
from servoid_experiments.paper.servoing import SEVERAL, SEVERAL_BEST, SIX_BEST, ServoingSettings
from servoid_experiments.paper.servoing_followed import Followed
from servoid_experiments.paper.servoing_plots import Column, draw_courses
from servoid_experiments.paper.servoing_rows import failures, over, period, response_table, rows_of
from servoid_experiments.paper.servoing_unknown import UNKNOWN, UnknownRow

_SMALL_LAG_DEG = 3.0
_HEAD = (
    "object",
    "runs",
    "ellipsoids",
    "looks",
    "hand: amplitude",
    "hand: lag",
    "hand: offset in x, y, z",
    "hand: left beside it in x, y, z",
    "hand: turn",
    "recognition: spread of x, y, z",
    "recognition: turn",
)
_Rows = Sequence[UnknownRow]


def future_sections(settings: ServoingSettings, results: Results, folder: Path) -> list[Section]:
    """Tell of runs to several ellipsoids, and to objects of which nothing is given.

    Raises:
        OutputError: a picture cannot be written.

    """
    kinds = [*settings.unknown.plain_objects, *settings.unknown.objects]
    found = [(kind, unknown_rows(results, kind)) for kind in kinds]
    found = [(kind, rows) for kind, rows in found if rows]
    known = [name for name in (SEVERAL, SEVERAL_BEST, SIX_BEST) if rows_of(results, name)]
    if not found and not known:
        return []
    tables = (
        [response_table(results, known, "The body is given; the fast motion.")] if known else []
    )
    if found:
        tables.append(_table(found))
    pictures = ()
    if found:
        columns = [
            Column(f"{kind.replace('_', ' ')}, nothing given", rows[0].followed.courses)
            for kind, rows in (found[0], found[-1])
        ]
        caption = (
            f"Servoing at {period(settings.omegas[1])} to objects of which nothing was given but "
            "their mask in the first left image. A constant offset of the hand is that of its "
            "goal: the truth is where the body was when it was modelled."
        )
        pictures = (draw_courses(columns, folder / "servoing_unknown.png", caption),)
    return [
        Section(
            heading="The future work: several ellipsoids, six degrees of freedom, nothing given",
            words=_words(settings, found) + failures(results.get(UNKNOWN.name, ())),
            findings=_findings(settings, results, found),
            pictures=pictures,
            tables=tuple(tables),
        )
    ]


def unknown_rows(results: Results, kind: str) -> list[UnknownRow]:
    """Return the rows of the runs to an object that did not fail."""
    done = results.get(UNKNOWN.name, ())
    return [one.row for one in done if one.case.object == kind and one.row is not None]


def _words(settings: ServoingSettings, found: Sequence[tuple[str, _Rows]]) -> tuple[str, ...]:
    if not found:
        return ()
    asked, away = settings.unknown, math.dist(settings.constants.scene.goal, (0.0, 0.0, 0.0))
    words = [
        f"The hand looks at the object, looks around it, models it with up to {asked.ellipsoids} "
        "ellipsoids, and follows it in six degrees of freedom with servoid's own method, on "
        f"images of {asked.size_px[0]} x {asked.size_px[1]} px.",
        "Amplitude and lag are of the swing; the offset is constant. A degree by which the "
        f"recognised turn is off moves the goal, {1e3 * away:.0f} mm from the object, by "
        f"{1e3 * math.radians(away):.1f} mm.",
    ]
    if asked.plain_objects:
        words.append(
            f"Objects of one colour ({', '.join(asked.plain_objects)}) are followed by their "
            "outlines alone, since the surface term has nothing to hold on to."
        )
    return tuple(words)


def _findings(
    settings: ServoingSettings, results: Results, found: Sequence[tuple[str, _Rows]]
) -> tuple[Finding, ...]:
    findings = []
    paper, best = rows_of(results, SEVERAL), rows_of(results, SEVERAL_BEST)
    if paper and best:
        lags = [over(rows, lambda row: row.hand_lag_deg) for rows in (paper, best)]
        spreads = [over(rows, lambda row: 1e3 * row.seen_spread[2]) for rows in (paper, best)]
        findings.append(
            Finding(
                before="Servoing with several ellipsoids is future work.",
                ours="With the body of two ellipsoids given, the paper's method follows with "
                f"{lags[0].written(1)} degrees of lag and {spreads[0].written(1)} mm of spread in "
                f"z, servoid's with {lags[1].written(2)} degrees and {spreads[1].written(2)} mm.",
                verdict=Verdict.BEYOND if _better(lags, spreads) else Verdict.PARTLY,
                why="Both fitness terms take any number of ellipsoids.",
            )
        )
    patterned = [row for kind, rows in found if kind in settings.unknown.objects for row in rows]
    if patterned:
        most = max(row.ellipsoids for row in patterned)
        worst = max(abs(row.followed.hand_lag_deg) for row in patterned)
        spread = interval([1e3 * row.followed.seen_spread[2] for row in patterned])
        turn = interval([row.hand_turn_deg for row in patterned])
        findings.append(
            Finding(
                before="Place alone is sought; orientation and shape are given.",
                ours="With nothing given, the hand lags or leads patterned objects of up to "
                f"{most} ellipsoids by {worst:.2f} degrees at most in {len(patterned)} runs; z "
                f"spreads by {spread.written(2)} mm and the hand is turned off by "
                f"{turn.written(2)} degrees.",
                verdict=Verdict.BEYOND if worst <= _SMALL_LAG_DEG else Verdict.PARTLY,
                why="The pattern that was learned while looking around tells z and turns far "
                "better than outlines do.",
            )
        )
    return tuple(findings)


def _better(lags: Sequence[Interval], spreads: Sequence[Interval]) -> bool:
    """Return whether servoid's method, the second of each pair, is late less and sees z better."""
    late, spread = abs(lags[1].mean), spreads[1].mean
    return late <= _SMALL_LAG_DEG and late < abs(lags[0].mean) and spread < spreads[0].mean


def _table(found: Sequence[tuple[str, _Rows]]) -> Table:
    return Table(
        _HEAD,
        [_cells(kind, rows) for kind, rows in found],
        "Nothing is given but the first mask; the fast motion. Means over runs, 95 %; the hand's "
        "offset by magnitude.",
    )


def _cells(kind: str, rows: _Rows) -> tuple[str, ...]:
    def mean(take: Callable[[UnknownRow], float]) -> Interval:
        return interval([take(row) for row in rows])

    def thrice(take: Callable[[Followed], Sequence[float]]) -> str:
        means = [
            mean(lambda row, axis=axis: 1e3 * abs(take(row.followed)[axis])).mean
            for axis in range(3)
        ]
        return ", ".join(f"{value:.2f}" for value in means) + " mm"

    return (
        kind,
        str(len(rows)),
        ", ".join(str(row.ellipsoids) for row in rows),
        ", ".join(str(row.looks) for row in rows),
        mean(lambda row: row.followed.hand_gain).written(3),
        mean(lambda row: row.followed.hand_lag_deg).written(2, " deg"),
        thrice(lambda row: row.hand_offset),
        thrice(lambda row: row.hand_jitter),
        mean(lambda row: row.hand_turn_deg).written(2, " deg"),
        thrice(lambda row: row.seen_spread),
        mean(lambda row: row.seen_turn_deg).written(2, " deg"),
    )

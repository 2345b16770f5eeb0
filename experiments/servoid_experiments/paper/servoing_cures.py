"""What cures the unsteady z and the lag of the hand, told one change after another."""

from collections.abc import Sequence
from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.findings import Finding, Picture, Section, Verdict
from servoid_experiments.paper.servoing import (
    ADDED,
    ALONE,
    BEST_NAME,
    FAST,
    FORWARD,
    REGION,
    SEARCH,
    SURFACE,
    ServoingSettings,
)
from servoid_experiments.paper.servoing_plots import Bar, Column, draw_courses, draw_cures
from servoid_experiments.paper.servoing_rows import over, period, response_table, rows_of
from servoid_experiments.paper.servoing_trial import ServoingRow

_BETTER = 1.2  # times as narrow counts as narrower
_TARGET_LAG_DEG = 3.0  # what is wanted of the hand at the fast motion with feed-forward
_VISIBLE_LAG_DEG = 5.0
_AMPLITUDE = 0.05  # by which the hand's may differ from the object's


def cure_section(settings: ServoingSettings, results: Results, folder: Path) -> Section:
    """Tell what each change of the paper's method does; the paper's runs must be there.

    Raises:
        OutputError: a picture cannot be written.

    """
    groups = [(FAST, 0), *((one.name, 1) for one in ALONE), *((one.name, 2) for one in ADDED)]
    known = [(name, group) for name, group in groups if rows_of(results, name)]
    pictures = [_cures(results, known, folder)]
    if rows_of(results, BEST_NAME):
        pictures.append(_beside(results, folder))
    named = period(settings.omegas[1])
    caption = f"The motion of {named}; means over runs, 95 %."
    return Section(
        heading="What cures the unsteady z and the lag",
        words=_words(results),
        findings=_findings(results, named),
        pictures=tuple(pictures),
        tables=(response_table(results, [name for name, _ in known], caption),),
    )


def _cures(results: Results, known: Sequence[tuple[str, int]], folder: Path) -> Picture:
    return draw_cures(
        [_bar(name, group, rows_of(results, name)) for name, group in known],
        folder / "servoing_cures.png",
        "What each change of the paper's method does at the fast motion: means and 95 % intervals "
        "over seeds. First each change alone, then one after another up to servoid's method; the "
        "dashed lines are the paper's method.",
    )


def _bar(name: str, group: int, rows: Sequence[ServoingRow]) -> Bar:
    return Bar(
        name="the paper's method" if group == 0 else name,
        group=group,
        z_spread=over(rows, lambda row: 1e3 * row.seen_spread[2]),
        x_spread=over(rows, lambda row: 1e3 * row.seen_spread[0]),
        lag=over(rows, lambda row: row.hand_lag_deg),
    )


def _beside(results: Results, folder: Path) -> Picture:
    """Draw the paper's method and servoid's beside each other, for as long as both ran."""
    courses = [rows_of(results, name)[0].followed.courses for name in (FAST, BEST_NAME)]
    until_s = min(one.seconds[-1] for one in courses)
    names = ("the paper's method", "servoid's method")
    columns = [Column(name, one, until_s) for name, one in zip(names, courses, strict=True)]
    caption = "The fast motion as the paper's method and as servoid's follow it, drawn as above."
    return draw_courses(columns, folder / "servoing_best.png", caption)


def _words(results: Results) -> tuple[str, ...]:
    paper = over(rows_of(results, FAST), lambda row: row.seen_spread[2]).mean
    said = []
    for one in (*ALONE, *ADDED):
        if rows := rows_of(results, one.name):
            now = over(rows, lambda row: row.seen_spread[2]).mean
            said.append(f"{one.name}: {1e3 * now:.2f} mm, {now / paper:.2f} of the paper's")
    words = [f"Spread of the recognised z: {'; '.join(said)}."] if said else []
    textured, plain = rows_of(results, SURFACE), rows_of(results, BEST_NAME)
    if textured and plain:
        z = [over(rows, lambda row: 1e3 * row.seen_bias[2]) for rows in (plain, textured)]
        words.append(
            "This object has one colour and no pattern, so the surface term has nothing to hold on "
            f"to. With it the recognised z is {z[1].written(1)} mm off, by outlines alone "
            f"{z[0].written(1)} mm; it is left out here. Objects with a pattern are followed with "
            "it below."
        )
    return tuple(words)


def _findings(results: Results, named: str) -> tuple[Finding, ...]:
    fast, forward = rows_of(results, FAST), rows_of(results, FORWARD)
    if not forward:
        return ()
    before, after = (over(rows, lambda row: row.hand_lag_deg) for rows in (fast, forward))
    z = [over(rows, lambda row: 1e3 * row.seen_spread[2]) for rows in (fast, forward)]
    gains = [over(rows, lambda row: row.hand_gain) for rows in (fast, forward)]
    faithful = abs(gains[1].mean - 1.0) <= _AMPLITUDE
    reached = faithful and abs(after.mean) + (after.half or 0.0) <= _TARGET_LAG_DEG
    visible = before.mean > _VISIBLE_LAG_DEG
    return (
        Finding(
            before="Recognition in z is to be improved.",
            ours=f"The spread of the recognised z goes from {z[0].written(2)} to "
            f"{z[1].written(2)} mm.",
            verdict=Verdict.BEYOND if z[1].mean * _BETTER < z[0].mean else Verdict.DIFFERS,
            why=_why(results),
        ),
        Finding(
            before="The hand's phase lag is left as it is.",
            ours=f"At {named} it goes from {before.written(1)} to {after.written(2)} degrees "
            f"(negative: early), the amplitude from {gains[0].written(3)} to "
            f"{gains[1].written(3)} of the object's; {_TARGET_LAG_DEG:g} degrees were aimed at.",
            verdict=Verdict.BEYOND if reached and visible else Verdict.PARTLY,
            why="The object's velocity comes from a filter that knows when each image was taken, "
            "and is fed forward to the hand and to the eyes.",
        ),
    )


def _why(results: Results) -> str:
    """Say what of the better z comes from the fitness, and what from the search."""
    parts = []
    for name, says in ((REGION, "the region term alone"), (SEARCH, "more search alone")):
        if rows := rows_of(results, name):
            left = over(rows, lambda row: 1e3 * row.seen_spread[2])
            parts.append(f"{says} leaves {left.written(2)} mm")
    said = f": {', '.join(parts)}" if parts else ""
    return (
        "A better fitness needs a search that gets to its peak, and more search a fitness whose "
        f"peak is the object's place{said}. servoid's tracker climbs to the peak from a few "
        "poses, along the gradient of the region term."
    )

"""Reports the paper's servoing (Figs. 10 and 11), changes to it, and the future work."""

import math
from collections.abc import Callable, Sequence

from servoid.batch import Results
from servoid_experiments.design import Cell, Picture, Section, Table, Verdict, rows_of
from servoid_experiments.paper.servoing.followed import Followed
from servoid_experiments.paper.servoing.plots import Bar, draw_changes, draw_courses
from servoid_experiments.paper.servoing.runs import (
    ADDED,
    ALONE,
    BEST_NAME,
    FAST,
    FORWARD,
    OTHER,
    OTHERS,
    READINGS,
    SEVERAL,
    SEVERAL_BEST,
    SLOW,
    ServoingSettings,
)
from servoid_experiments.paper.servoing.settings import Constants, constants
from servoid_experiments.paper.servoing.trial import SERVOING, ServoingRow
from servoid_experiments.paper.servoing.unknown import UNKNOWN, UnknownRow
from servoid_experiments.stats import Spread, interval_cells, interval_headings, over

_SHARED = 0.25  # of x's variance that correlates with z, above which z disturbs x
_UNSTEADY = 1.2  # ratio of the spreads, above which one counts as wider
_RECOGNISED_M = 0.03  # error above which an object of this size counts as missed
_SMALL_LAG_DEG, _VISIBLE_LAG_DEG = 3.0, 5.0  # required with feed-forward, and visible without
_AMPLITUDE = 0.05  # relative difference allowed between hand and object

_NAMES = (SLOW, FAST, OTHER, *(one.name for one in (*READINGS, *ALONE, *ADDED, *OTHERS)))
_Rows = dict[str, list[ServoingRow]]

_XYZ = tuple(enumerate("xyz"))
FIGURES: dict[str, Callable[[Followed], float]] = {
    "hand_gain": lambda row: row.hand_gain,
    "hand_lag_deg": lambda row: row.hand_lag_deg,
    "seen_gain": lambda row: row.seen_gain,
    "seen_lag_deg": lambda row: row.seen_lag_deg,
    **{f"seen_spread_{x}_mm": lambda row, i=i: 1e3 * row.seen_spread[i] for i, x in _XYZ},
    **{f"seen_bias_{x}_mm": lambda row, i=i: 1e3 * row.seen_bias[i] for i, x in _XYZ},
    **{f"seen_worst_{x}_mm": lambda row, i=i: 1e3 * row.seen_worst[i] for i, x in _XYZ},
    **{f"hand_rms_{x}_mm": lambda row, i=i: 1e3 * row.hand_rms[i] for i, x in _XYZ},
    **{f"hand_offset_{x}_mm": lambda row, i=i: 1e3 * abs(row.hand_offset[i]) for i, x in _XYZ},
    **{f"hand_jitter_{x}_mm": lambda row, i=i: 1e3 * row.hand_jitter[i] for i, x in _XYZ},
    "x_by_z": lambda row: row.x_by_z,
    "z_growth": lambda row: row.z_spread_by_period[-1] / row.z_spread_by_period[0],
}
"""Figures of a run; growth is the ratio of z's spread in the last period to that in the first.

Gains and lags are relative to the object, spreads are standard deviations of the recognition's
errors.
"""
_UNKNOWN: dict[str, Callable[[UnknownRow], float]] = {
    "ellipsoids": lambda row: float(row.ellipsoids),
    "looks": lambda row: float(row.looks),
    "hand_turn_deg": lambda row: row.hand_turn_deg,
    "seen_turn_deg": lambda row: row.seen_turn_deg,
}


def servoing_sections(settings: ServoingSettings, results: Results) -> list[Section]:
    """Draw courses and changes, and list all figures of all runs."""
    found = {name: rows for name in _NAMES if (rows := rows_of(results, SERVOING, name=name))}
    kinds = [*settings.unknown.plain_objects, *settings.unknown.objects]
    unknown = {kind: rows for kind in kinds if (rows := rows_of(results, UNKNOWN, object=kind))}
    sections = []
    if SLOW in found and FAST in found:
        sections.append(_paper_section(settings, found))
        sections.append(_change_section(found))
    if unknown or SEVERAL in found:
        sections.append(_future_section(settings, found, unknown))
    if found:
        tables = (_table(found), constants_table(settings.constants))
        sections.append(Section("Servoing: all figures, and the constants", tables=tables))
    return sections


def period(omega: float) -> str:
    """Return the period of a motion in words, such as `T = 10 s`; `omega` is in rad/s."""
    return f"T = {2.0 * math.pi / omega:.2g} s"


def constants_table(given: Constants) -> Table:
    """Return each constant of the paper's servoing with its meaning and its source."""
    return Table(
        "servoing_constants",
        ("constant", "value", "meaning", "source"),
        constants(given),
        "All constants of the paper's servoing, and where each is from.",
    )


def _figure(rows: Sequence[ServoingRow], name: str) -> Spread:
    return over(FIGURES[name](row.followed) for row in rows)


def _table(found: _Rows) -> Table:
    lines: list[tuple[Cell, ...]] = []
    for name, rows in found.items():
        cells = interval_cells(_figure(rows, figure) for figure in FIGURES)
        worst = max(1e3 * max(row.followed.seen_worst) for row in rows)
        held = max(row.held_share for row in rows)
        lines.append((name, len(rows), *cells, worst, over(row.scored for row in rows).mean, held))
    return Table(
        "servoing_figures",
        ("run", "runs", *interval_headings(FIGURES), "seen_worst_mm", "poses_scored_an_image",
         "held_share"),
        lines,
        "Means over the runs, with the half width of their 95 % intervals.",
    )  # fmt: skip


def _paper_section(settings: ServoingSettings, found: _Rows) -> Section:
    columns = [
        (f"{period(omega)}, the paper's method", found[name][0].followed.courses)
        for omega, name in zip(settings.omegas, (SLOW, FAST), strict=True)
    ]
    caption = (
        "Figs. 10 and 11 of the paper, one run each: place of the object, of what was recognised "
        "and of the hand, along the axes of M0, the object's frame at its start (x right, y down, "
        "z away from the hand). The hand is counted from where it should be at the start. y and z "
        "have a scale of their own."
    )
    picture = draw_courses(columns, "servoing", caption)
    heading = "Section 5.3, Figs. 10 and 11: servoing to one ellipsoid"
    return Section(heading, _paper_findings(found), (picture,))


def _paper_findings(found: _Rows) -> dict[str, Verdict]:
    slow, fast = (
        {name: _figure(found[run], name) for name in FIGURES} for run in (SLOW, FAST)
    )  # fmt: skip
    late = 0.0 < slow["hand_lag_deg"].mean < fast["hand_lag_deg"].mean
    worst = max(max(row.followed.seen_worst) for row in found[SLOW])
    works = abs(slow["seen_gain"].mean - 1.0) < 0.02 and worst < _RECOGNISED_M
    wider = fast["seen_spread_z_mm"].mean > _UNSTEADY * slow["seen_spread_z_mm"].mean
    growth = fast["z_growth"]
    grows = growth.half is not None and growth.mean - growth.half > 1.0
    linked = fast["x_by_z"].mean ** 2 >= _SHARED
    spoilt = fast["seen_spread_x_mm"].mean > _UNSTEADY * slow["seen_spread_x_mm"].mean
    unstable = Verdict.AGREES if grows else Verdict.PARTLY
    return {
        "The hand follows the object with a phase lag at either speed.": (
            Verdict.AGREES if late else Verdict.DIFFERS
        ),
        "The object is recognised all the time at the slow motion.": (
            Verdict.AGREES if works else Verdict.DIFFERS
        ),
        "Recognition becomes unstable in z as time passes at the fast motion.": (
            unstable if wider else Verdict.DIFFERS
        ),
        "The unsteady z has a bad influence on x.": (
            (Verdict.DIFFERS, Verdict.PARTLY, Verdict.AGREES)[linked + spoilt]
        ),
    }


def _change_section(found: _Rows) -> Section:
    groups = [(FAST, 0), *((one.name, 1) for one in ALONE), *((one.name, 2) for one in ADDED)]
    bars = [
        Bar(
            name="the paper's method" if group == 0 else name,
            group=group,
            spreads=(
                _figure(found[name], "seen_spread_z_mm"),
                _figure(found[name], "seen_spread_x_mm"),
                _figure(found[name], "hand_lag_deg"),
            ),
        )
        for name, group in groups
        if name in found
    ]
    caption = (
        "What each change of the paper's method does at the fast motion: means and 95 % intervals "
        "over seeds. First each change alone, then one after another up to servoid's method; the "
        "dashed lines are the paper's method."
    )
    pictures = [draw_changes(bars, "servoing_changes", caption)]
    if BEST_NAME in found:
        pictures.append(_beside(found))
    findings = _improvement_findings(found) if FORWARD in found else {}
    return Section("What improves the unsteady z and the lag", findings, pictures)


def _beside(found: _Rows) -> Picture:
    """Draw the paper's method and servoid's side by side, for as long as both ran."""
    courses = [found[name][0].followed.courses for name in (FAST, BEST_NAME)]
    until_s = min(one.seconds[-1] for one in courses)
    names = ("the paper's method", "servoid's method")
    columns = list(zip(names, courses, strict=True))
    caption = "The fast motion as the paper's method and as servoid's follow it, drawn as above."
    return draw_courses(columns, "servoing_best", caption, until_s)


def _improvement_findings(found: _Rows) -> dict[str, Verdict]:
    z = [_figure(found[name], "seen_spread_z_mm").mean for name in (FAST, FORWARD)]
    before, after = (_figure(found[name], "hand_lag_deg") for name in (FAST, FORWARD))
    faithful = abs(_figure(found[FORWARD], "hand_gain").mean - 1.0) <= _AMPLITUDE
    reached = faithful and abs(after.mean) + (after.half or 0.0) <= _SMALL_LAG_DEG
    gone = reached and before.mean > _VISIBLE_LAG_DEG
    better = z[1] * _UNSTEADY < z[0]
    return {
        "Recognition in z is to be improved.": Verdict.BEYOND if better else Verdict.DIFFERS,
        "The hand's phase lag is left as it is.": Verdict.BEYOND if gone else Verdict.PARTLY,
    }


def _future_section(
    settings: ServoingSettings, found: _Rows, unknown: dict[str, list[UnknownRow]]
) -> Section:
    findings, pictures = {}, ()
    if SEVERAL in found and SEVERAL_BEST in found:
        lag, z = (
            [_figure(found[name], figure).mean for name in (SEVERAL, SEVERAL_BEST)]
            for figure in ("hand_lag_deg", "seen_spread_z_mm")
        )
        better = abs(lag[1]) <= _SMALL_LAG_DEG and abs(lag[1]) < abs(lag[0]) and z[1] < z[0]
        verdict = Verdict.BEYOND if better else Verdict.PARTLY
        findings["Servoing with several ellipsoids is future work."] = verdict
    patterned = [row for kind in settings.unknown.objects for row in unknown.get(kind, ())]
    if patterned:
        worst = max(abs(row.followed.hand_lag_deg) for row in patterned)
        verdict = Verdict.BEYOND if worst <= _SMALL_LAG_DEG else Verdict.PARTLY
        findings["Place alone is sought; orientation and shape are given."] = verdict
    if unknown:
        kinds = list(unknown)
        columns = [
            (f"{kind.replace('_', ' ')}, nothing given", unknown[kind][0].followed.courses)
            for kind in (kinds[0], kinds[-1])
        ]
        caption = (
            "Servoing at the fast motion to objects of which nothing was given but their mask in "
            "the first left image. A constant offset of the hand is that of its goal: the truth is "
            "where the body was when it was modelled."
        )
        pictures = (draw_courses(columns, "servoing_unknown", caption),)
    heading = "The future work: several ellipsoids, six degrees of freedom, nothing given"
    tables = (_unknown_table(unknown),) if unknown else ()
    return Section(heading, findings, pictures, tables)


def _unknown_table(unknown: dict[str, list[UnknownRow]]) -> Table:
    lines: list[tuple[Cell, ...]] = []
    for kind, rows in unknown.items():
        means = [over(map(take, rows)).mean for take in _UNKNOWN.values()]
        figures = [over(take(row.followed) for row in rows).mean for take in FIGURES.values()]
        worst = max(abs(row.followed.hand_lag_deg) for row in rows)
        lines.append((kind, len(rows), *means, *figures, worst))
    return Table(
        "servoing_unknown_figures",
        ("object", "runs", *_UNKNOWN, *FIGURES, "hand_lag_at_most_deg"),
        lines,
        "Nothing is given but the first mask; the fast motion. Means over the runs.",
    )

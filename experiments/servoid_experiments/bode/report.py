"""The study of how recognition, gaze and hand respond to an object that swings, and of margins."""

from collections.abc import Sequence

import numpy as np

from servoid.batch import Done, Results
from servoid_experiments.bode.curves import AXES, Bode, bode_png
from servoid_experiments.bode.margin import MARGIN
from servoid_experiments.bode.margins_report import report_margins
from servoid_experiments.bode.plan import (
    HALF,
    QUICK,
    VARIANTS,
    BodeSettings,
    ResponseSettings,
    plan,
)
from servoid_experiments.bode.response import RESPONSE, ResponseCase, ResponseRow
from servoid_experiments.design import Cell, Picture, Section, Study, Table, Verdict
from servoid_experiments.stats import over

SIGNALS = {
    "seen": "where the tracker saw it, at the time of the image",
    "known": "the newest estimate when it is used",
    "predicted": "where the filter predicts it by then",
    "gaze": "where the eyes look",
    "hand": "the hand",
}
_RECOGNITION = ("seen", "known", "predicted")
_ENDS = ("", "_low", "_high")  # of a figure: median and extremes
_BEST, _PLAIN = "feed-forward, eyes follow", "no feed-forward, eyes follow"
_BANDS = (
    "Lines are medians over the runs, bands reach from the least to the greatest. In the grey "
    "strip the amplitude is within 3 dB of the object's; a negative phase is a lag."
)

Curves = dict[tuple[str, str, str], Bode]


def report_bode(settings: BodeSettings, results: Results) -> Sequence[Section]:
    """Draw the figures, and return the sections with their numbers."""
    sections = [
        *report_responses(settings.response, results.get(RESPONSE.name, ())),
        *report_margins(settings.margin, results.get(MARGIN.name, ())),
    ]
    return sections or [Section("No trial succeeded")]


def report_responses(settings: ResponseSettings, done: Sequence[Done]) -> list[Section]:
    """Draw three Bode diagrams with their numbers, and list the findings; nothing without runs."""
    runs = {
        name: [
            (one.case, one.row)
            for one in done
            if one.row is not None and (one.case.feed_forward, one.case.eyes_follow) == variant
        ]
        for name, variant in VARIANTS.items()
    }
    whole = {
        name: [row for case, row in pairs if case.scale == 1.0] for name, pairs in runs.items()
    }
    curves = _gather(whole)
    if any((name, "hand", "sideways") not in curves for name in VARIANTS):
        return []
    shown = {
        "hand": ("How the hand answers the object's motion", _variants(curves, "hand")),
        "gaze": ("How the point at which the eyes look answers it", _variants(curves, "gaze")),
        "recognition": (
            "How what is known of the object answers its motion (feed-forward, eyes follow)",
            {SIGNALS[signal]: _by_axis(curves, _BEST, signal) for signal in _RECOGNITION},
        ),
    }
    pictures = [
        Picture(name, f"{title}. {_BANDS}", bode_png(title, drawn))
        for name, (title, drawn) in shown.items()
    ]
    findings = {"The hand follows with a phase lag (Section 5.3).": _lags(settings, curves)}
    tables = (
        _summary(settings, curves), _limits(whole), _halved(runs[_BEST]), _responses(curves)
    )  # fmt: skip
    return [Section("How recognition, gaze and hand answer", findings, pictures, tables)]


def _gather(runs: dict[str, list[ResponseRow]]) -> Curves:
    """Collect the responses, by variant, signal and axis."""
    found = {
        (name, signal, axis): Bode.of(rows, signal, axis)
        for name, rows in runs.items()
        for signal in SIGNALS
        for axis in AXES
    }
    return {place: bode for place, bode in found.items() if bode is not None}


def _lags(settings: ResponseSettings, curves: Curves) -> Verdict:
    """Compare the lags without feed-forward and with it; a negative phase is a lag."""
    with_it, without = (
        -curves[name, "hand", "sideways"].phase_at(settings.lag_hz).middle
        for name in (_BEST, _PLAIN)
    )
    if without <= 0.0:
        return Verdict.DIFFERS
    return Verdict.BEYOND if abs(with_it) < abs(without) else Verdict.AGREES


def _summary(settings: ResponseSettings, curves: Curves) -> Table:
    names = ("lag_deg", "missed", "within_3db_hz", "falls_by_3db_hz", "greatest_gain", "delay_s")
    rows: list[tuple[Cell, ...]] = []
    for place, bode in curves.items():
        figures = (
            bode.phase_at(settings.lag_hz, -1.0),
            bode.missed_at(settings.lag_hz),
            bode.faithful_hz,
            bode.bandwidth_hz,
            bode.peak,
            bode.delay_s,
        )
        cells = [cell for one in figures for cell in (one.middle, one.low, one.high)]
        off = float(np.abs(bode.bands[0][0] - 1.0).max())
        rows.append((*place, len(bode.gains), *cells, bode.peak_hz, off))
    return Table(
        "response_figures",
        ("variant", "signal", "axis", "runs", *(f"{name}{end}" for name in names for end in _ENDS),
         "greatest_gain_hz", "gain_off_at_most"),
        rows,
        f"Medians and extremes over the runs; lag and missed share at {settings.lag_hz:g} Hz; inf: "
        "above all frequencies.",
    )  # fmt: skip


def _limits(runs: dict[str, list[ResponseRow]]) -> Table:
    """List what makes the responses nonlinear."""
    rows: list[tuple[Cell, ...]] = []
    for name, found in runs.items():
        limited = over(row.limited_share for row in found)
        answers = [row.answer("hand", axis) for row in found for axis in AXES]
        rows.append(
            (
                name,
                max(row.joint_speed_share for row in found),
                max(row.joint_acceleration_share for row in found),
                *(limited.low, limited.middle, limited.high),
                max(one.floor for one in answers if one is not None),
            )
        )
    return Table(
        "response_limits",
        ("variant", "joint_speed_share", "joint_acceleration_share", "limited_share_low",
         "limited_share", "limited_share_high", "hand_at_rest_m"),
        rows,
        "Greatest shares of the joints' limits that were used, control periods at a limit, and the "
        "hand's motion at frequencies at which nothing moves.",
    )  # fmt: skip


def _halved(pairs: Sequence[tuple[ResponseCase, ResponseRow]]) -> Table:
    """List how the hand's gain changes at half the amplitudes, seed by seed."""
    runs = {(case.seed, case.scale): row for case, row in pairs}
    rows: list[tuple[Cell, ...]] = []
    for (seed, scale), row in runs.items():
        whole = runs.get((seed, 1.0))
        if scale != HALF or whole is None:
            continue
        for axis in AXES:
            half_answer, whole_answer = row.answer("hand", axis), whole.answer("hand", axis)
            if half_answer is not None and whole_answer is not None:
                ratios = np.abs(half_answer.ratio) / np.abs(whole_answer.ratio)
                both = zip(half_answer.hz, ratios.tolist(), strict=True)
                rows += [(seed, axis, *pair) for pair in both]
    return Table(
        "response_halved",
        ("seed", "axis", "hz", "ratio"),
        rows,
        "The hand's gain with half the amplitudes over that with the whole, by the same seed.",
    )


def _variants(curves: Curves, signal: str) -> dict[str, dict[str, Bode]]:
    found = {name: _by_axis(curves, name, signal) for name in VARIANTS}
    return {name: by_axis for name, by_axis in found.items() if by_axis}


def _by_axis(curves: Curves, variant: str, signal: str) -> dict[str, Bode]:
    found = {axis: curves.get((variant, signal, axis)) for axis in AXES}
    return {axis: bode for axis, bode in found.items() if bode is not None}


def _responses(curves: Curves) -> Table:
    """Return gains and phases: a line for each variant, signal, axis and frequency."""
    names = ("gain", "gain_low", "gain_high", "phase_deg", "phase_low_deg", "phase_high_deg")
    lines: list[tuple[Cell, ...]] = []
    for place, bode in curves.items():
        gains, phases = bode.bands
        for hz, *values in zip(bode.hz, *gains, *phases, strict=True):
            numbers = [f"{value:.5g}" for value in values]
            lines.append((*place, f"{hz:g}", *numbers, len(bode.gains)))
    return Table("responses", ("variant", "signal", "axis", "hz", *names, "runs"), lines)


BODE = Study(
    name="bode",
    title="Frequency responses and margins",
    question=(
        "Up to which frequency do recognition, gaze and hand follow, with and without feed-forward "
        "and turning eyes, and how much gain, delay and latency does the loop withstand?"
    ),
    settings=BodeSettings,
    quick=QUICK,
    plan=plan,
    report=report_bode,
)

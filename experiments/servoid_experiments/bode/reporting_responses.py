"""Reports the responses of recognition, gaze and hand to an object that swings."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servoid.output import write_together
from servoid_experiments.bode.drawing import AXES, bode_png
from servoid_experiments.bode.planning import HALF, VARIANTS
from servoid_experiments.bode.response import ResponseCase, ResponseRow
from servoid_experiments.bode.settings import ResponseSettings
from servoid_experiments.bode.spread import Bode
from servoid_experiments.design import Done
from servoid_experiments.report import Cell, Finding, Picture, Section, Table, Verdict, csv_of
from servoid_experiments.stats import Spread

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
Kept = Sequence[tuple[ResponseCase, ResponseRow]]


def report_responses(
    settings: ResponseSettings, done: Sequence[Done], folder: Path
) -> list[Section]:
    """Draw three Bode diagrams with their numbers, and list the findings; nothing without runs.

    Raises:
        OutputError: a file cannot be written.

    """
    kept = [(one.case, one.row) for one in done if one.row is not None]
    curves = gather([(case, row) for case, row in kept if case.scale == 1.0])
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
    files = {folder / f"{name}.png": bode_png(title, of) for name, (title, of) in shown.items()}
    files[folder / "responses.csv"] = _responses_csv(curves)
    write_together(files)
    pictures = [
        Picture(folder / f"{name}.png", f"{title}. {_BANDS}") for name, (title, _) in shown.items()
    ]
    findings = (
        Finding("The hand follows with a phase lag (Section 5.3).", _lags(settings, curves)),
    )
    tables = (_summary(settings, curves), _limits(kept), _halved_table(kept))
    return [Section("How recognition, gaze and hand answer", findings, tuple(pictures), tables)]


def gather(kept: Kept) -> Curves:
    """Collect the responses, by variant, signal and axis."""
    curves: Curves = {}
    for name, variant in VARIANTS.items():
        rows = [row for case, row in kept if (case.feed_forward, case.eyes_follow) == variant]
        for signal in SIGNALS:
            for axis in AXES:
                bode = Bode.of(rows, signal, axis)
                if bode is not None:
                    curves[name, signal, axis] = bode
    return curves


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
        cells = [cell for one in figures for cell in _cells(one)]
        off = float(np.abs(bode.gain.middle - 1.0).max())
        rows.append((*place, len(bode.gains), *cells, bode.peak_hz, off))
    return Table(
        "response_figures",
        f"Medians and extremes over the runs; lag and missed share at {settings.lag_hz:g} Hz; inf: "
        "above all frequencies.",
        ("variant", "signal", "axis", "runs", *(f"{name}{end}" for name in names for end in _ENDS),
         "greatest_gain_hz", "gain_off_at_most"),
        rows,
    )  # fmt: skip


def _cells(spread: Spread) -> tuple[float, float, float]:
    return spread.middle, spread.low, spread.high


def _limits(kept: Kept) -> Table:
    """List what makes the responses nonlinear."""
    rows: list[tuple[Cell, ...]] = []
    for name, variant in VARIANTS.items():
        runs = [
            row
            for case, row in kept
            if (case.feed_forward, case.eyes_follow) == variant and case.scale == 1.0
        ]
        answers = [row.answer("hand", axis) for row in runs for axis in AXES]
        limited = [row.limited_share for row in runs]
        rows.append(
            (
                name,
                max(row.joint_speed_share for row in runs),
                max(row.joint_acceleration_share for row in runs),
                min(limited),
                float(np.median(limited)),
                max(limited),
                max(one.floor for one in answers if one is not None),
            )
        )
    return Table(
        "response_limits",
        "Greatest shares of the joints' limits that were used, control periods at a limit, and the "
        "hand's motion at frequencies at which nothing moves.",
        ("variant", "joint_speed_share", "joint_acceleration_share", "limited_share_low",
         "limited_share", "limited_share_high", "hand_at_rest_m"),
        rows,
    )  # fmt: skip


def _halved_table(kept: Kept) -> Table:
    """List how the hand's gain changes at half the amplitudes, seed by seed."""
    rows: list[tuple[Cell, ...]] = []
    runs = {
        (case.seed, case.scale): row
        for case, row in kept
        if (case.feed_forward, case.eyes_follow) == VARIANTS[_BEST]
    }
    for (seed, scale), row in runs.items():
        whole = runs.get((seed, 1.0))
        if scale != HALF or whole is None:
            continue
        for axis in AXES:
            half_answer, whole_answer = row.answer("hand", axis), whole.answer("hand", axis)
            if half_answer is not None and whole_answer is not None:
                ratios = np.abs(half_answer.ratio) / np.abs(whole_answer.ratio)
                rows += [
                    (seed, axis, *pair)
                    for pair in zip(half_answer.hz, ratios.tolist(), strict=True)
                ]
    return Table(
        "response_halved",
        "The hand's gain with half the amplitudes over that with the whole, by the same seed.",
        ("seed", "axis", "hz", "ratio"),
        rows,
    )


def _variants(curves: Curves, signal: str) -> dict[str, dict[str, Bode]]:
    found = {name: _by_axis(curves, name, signal) for name in VARIANTS}
    return {name: by_axis for name, by_axis in found.items() if by_axis}


def _by_axis(curves: Curves, variant: str, signal: str) -> dict[str, Bode]:
    found = {axis: curves.get((variant, signal, axis)) for axis in AXES}
    return {axis: bode for axis, bode in found.items() if bode is not None}


def _responses_csv(curves: Curves) -> bytes:
    """Return gains and phases: a line for each variant, signal, axis and frequency."""
    names = ("gain", "gain_low", "gain_high", "phase_deg", "phase_low_deg", "phase_high_deg")
    lines: list[tuple[Cell, ...]] = []
    for place, bode in curves.items():
        bands = [
            values
            for band in (bode.gain, bode.phase_deg)
            for values in (band.middle, band.low, band.high)
        ]
        for index, hz in enumerate(bode.hz):
            numbers = [f"{values[index]:.5g}" for values in bands]
            lines.append((*place, f"{hz:g}", *numbers, len(bode.gains)))
    return csv_of(("variant", "signal", "axis", "hz", *names, "runs"), lines)

"""Says how recognition, gaze and hand answer an object that swings."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servoid.output import write_whole
from servoid_experiments.bode.drawing import AXES, bode_png
from servoid_experiments.bode.planning import HALF, VARIANTS
from servoid_experiments.bode.response import ResponseCase, ResponseRow
from servoid_experiments.bode.settings import ResponseSettings
from servoid_experiments.bode.spread import HALF_POWER, Bode, Spread
from servoid_experiments.bode.tables import write_responses
from servoid_experiments.design import Done
from servoid_experiments.findings import Finding, Picture, Section, Table, Verdict
from servoid_experiments.sweeping import percent_sure

SIGNALS = {
    "seen": "where the tracker saw it, at the time of the image",
    "known": "the newest estimate when it is used",
    "predicted": "where the filter predicts it by then",
    "gaze": "where the eyes look",
    "hand": "the hand",
}
_HEARD = ("seen", "known", "predicted")
_BEST, _PLAIN = "feed-forward, eyes follow", "no feed-forward, eyes follow"

Curves = dict[tuple[str, str, str], Bode]
Kept = Sequence[tuple[ResponseCase, ResponseRow]]


def tell_responses(settings: ResponseSettings, done: Sequence[Done], folder: Path) -> list[Section]:
    """Draw three Bode diagrams and say what they show, or which runs are missing for that."""
    kept = [(one.case, one.row) for one in done if one.row is not None]
    curves = gather([(case, row) for case, row in kept if case.scale == 1.0])
    missing = [name for name in VARIANTS if (name, "hand", "sideways") not in curves]
    if missing:
        words = f"No run succeeded with {'; '.join(missing)}: there is nothing to compare with."
        return [Section("How recognition, gaze and hand answer", (words,))]
    write_responses(folder / "responses.csv", curves)
    return [
        _hand(settings, curves, folder),
        _gaze(settings, curves, folder),
        _recognition(settings, curves, folder),
        _linearity(settings, kept),
    ]


def gather(kept: Kept) -> Curves:
    """Gather what was heard, by variant, signal and axis."""
    curves: Curves = {}
    for name, variant in VARIANTS.items():
        rows = [row for case, row in kept if (case.feed_forward, case.eyes_follow) == variant]
        for signal in SIGNALS:
            for axis in AXES:
                bode = Bode.of(rows, signal, axis)
                if bode is not None:
                    curves[name, signal, axis] = bode
    return curves


def _hand(settings: ResponseSettings, curves: Curves, folder: Path) -> Section:
    runs, highest = _runs(curves), _highest(settings)
    best, plain = (curves[name, "hand", "sideways"] for name in (_BEST, _PLAIN))
    lags = [bode.phase_at(settings.lag_hz) for bode in (best, plain)]
    told, untold = (_lag(lag) for lag in lags)
    words = (
        f"An object swings at {len(settings.sideways_lines)} frequencies sideways and at "
        f"{len(settings.depth_lines)} others in depth, all at once; the real loop follows it, with "
        f"images that are drawn and a tracker that is servoid's own. In each of the {runs} runs of "
        "each variant the phases, the noise and the room are others. A line is the median of the "
        f"runs, a band reaches from the least to the greatest: with {percent_sure(runs, 0)} % "
        "probability it holds the median of all such runs.",
        f"At {settings.lag_hz:g} Hz, a period of {1.0 / settings.lag_hz:g} s, the hand lags the "
        f"object by {told} with feed-forward and by {untold} without.",
        f"With feed-forward the hand is within 3 dB of the object up to "
        f"{_hz(best.faithful_hz, highest)}; it swings at most {best.peak.words(2)} times as wide "
        f"as the object, near {best.peak_hz:.2g} Hz. Without, its amplitude falls by 3 dB at "
        f"{_hz(plain.bandwidth_hz, highest)}, and is at most {plain.peak.words(2)} times the "
        "object's.",
        *_peak_words(best, plain),
    )
    finding = _lag_finding(
        f"At {settings.lag_hz:g} Hz {untold} without feed-forward, {told} with it.", lags
    )
    picture = _draw(
        folder / "hand.png",
        "How the hand answers the object's motion",
        {name: _by_axis(curves, name, "hand") for name in VARIANTS},
        "Ratio of amplitudes and phase of the hand against the object, by frequency. In the grey "
        "strip the amplitude is within 3 dB; a negative phase is a lag.",
    )
    table = _variants(settings, curves, "hand")
    return Section("The hand", words, (finding,), (picture,), (table,))


def _peak_words(best: Bode, plain: Bode) -> tuple[str, ...]:
    """Say what feed-forward costs, if the hand swings wider for it in the middle of the runs."""
    if not max(best.gain.middle) > max(1.0, *plain.gain.middle) / HALF_POWER:
        return ()
    return (
        "What is fed forward is motion that was seen a latency ago: motion that has turned round "
        "since then is fed forward wrongly. Feed-forward serves what moves slowly, and pays for it "
        "with a peak.",
    )


def _lag_finding(ours: str, lags: Sequence[Spread]) -> Finding:
    """Compare the lags with feed-forward and without, of which phases are the negative."""
    told, untold = (-(lag.middle or 0.0) for lag in lags)
    is_less = abs(told) < abs(untold)
    return Finding(
        before="The hand follows the moving object with a phase lag (Section 5.3).",
        ours=ours,
        verdict=Verdict.DIFFERS if untold <= 0.0 else Verdict.BEYOND if is_less else Verdict.AGREES,
        why="The lag is that of a loop that answers errors only; the object's estimated velocity "
        + ("takes it away." if is_less else "does not take it away here."),
    )


def _gaze(settings: ResponseSettings, curves: Curves, folder: Path) -> Section:
    highest = _highest(settings)
    turning = curves[_BEST, "gaze", "sideways"]
    still = curves["feed-forward, fixed cameras", "gaze", "sideways"]
    miss, missed = (_missed(bode, settings.lag_hz) for bode in (turning, still))
    words = (
        "Where the eyes look is the point at which their axes pierce the plane that the object is "
        "in, the mean of both; in depth, where the axes cross. Cameras that are fixed to the hand "
        "look where the hand leads them, and their axes cross nowhere.",
        f"At {settings.lag_hz:g} Hz eyes that follow miss {miss} of the object's motion, fixed "
        f"cameras {missed}. Eyes that follow are within 3 dB up to "
        f"{_hz(turning.faithful_hz, highest)} and swing at most {turning.peak.words(1)} times as "
        "wide as the object.",
    )
    picture = _draw(
        folder / "gaze.png",
        "How the point at which the eyes look answers the object's motion",
        {name: _by_axis(curves, name, "gaze") for name in VARIANTS},
        "As for the hand, for the point at which the eyes look. Fixed cameras have none in depth.",
    )
    return Section("The gaze", words, (), (picture,), (_variants(settings, curves, "gaze"),))


def _recognition(settings: ResponseSettings, curves: Curves, folder: Path) -> Section:
    seen, known, ahead = (curves[_BEST, signal, "sideways"] for signal in _HEARD)
    worst = max(float(np.abs(curves[_BEST, "seen", axis].gain.middle - 1.0).max()) for axis in AXES)
    depth = curves[_BEST, "predicted", "depth"]
    words = (
        f"At the time of its image, recognition differs from the truth by {100 * worst:.1f} % of "
        f"the amplitude or less at every frequency up to {_highest(settings):g} Hz, sideways and "
        f"in depth; its delay is {seen.delay_s.words(1, 1000.0)} ms.",
        f"By the time it is used it is {known.delay_s.words(0, 1000.0)} ms old: the latency, and "
        "the wait for the next image.",
        f"The filter's prediction of where it is by then lags by "
        f"{_lag(ahead.phase_at(settings.lag_hz))} at {settings.lag_hz:g} Hz, and swings at most "
        f"{ahead.peak.words(2)} times as wide as the object sideways and {depth.peak.words(2)} "
        f"times in depth. It is within 3 dB up to {_hz(ahead.faithful_hz, _highest(settings))} "
        "sideways. Hand and gaze follow it, with its peaks.",
    )
    picture = _draw(
        folder / "recognition.png",
        "How what is known of the object answers its motion (feed-forward, eyes follow)",
        {SIGNALS[signal]: _by_axis(curves, _BEST, signal) for signal in _HEARD},
        "Ratio of amplitudes and phase of what is known of the object against the truth.",
    )
    return Section("Recognition", words, (), (picture,))


def _linearity(settings: ResponseSettings, kept: Kept) -> Section:
    """Say whether the answers may be called a frequency response at all."""
    rows = []
    for name, variant in VARIANTS.items():
        runs = [
            row
            for case, row in kept
            if (case.feed_forward, case.eyes_follow) == variant and case.scale == 1.0
        ]
        floor = [row.answer("hand", axis) for row in runs for axis in AXES]
        rows.append(
            (
                name,
                f"{100 * max(row.joint_speed_share for row in runs):.0f} %",
                f"{100 * max(row.joint_acceleration_share for row in runs):.0f} %",
                f"{100 * float(np.median([row.limited_share for row in runs])):.1f} %",
                f"{1e3 * max(one.floor for one in floor if one is not None):.2f} mm",
            )
        )
    table = Table(
        (
            "variant",
            "joints' speed limit in use, at most",
            "joints' acceleration limit in use, at most",
            "control periods at a limit, median",
            "hand at frequencies that nothing moves",
        ),
        rows,
        "What keeps the answers from being linear.",
    )
    return Section("Is that a frequency response?", _doubts(settings, kept), (), (), (table,))


def _doubts(settings: ResponseSettings, kept: Kept) -> tuple[str, ...]:
    runs = [row for case, row in kept if case.scale == 1.0]
    acceleration = max(row.joint_acceleration_share for row in runs)
    limited = [row.limited_share for row in runs]
    words = (
        "An answer is a frequency response if it grows with what it answers, so no limit should be "
        f"reached. The single sines are no faster than {1e3 * settings.speed:g} mm/s and no wider "
        f"than {1e3 * settings.amplitude:g} mm, for which joints turn at "
        f"{100 * max(row.joint_speed_share for row in runs):.0f} % of their fastest or less.",
        "The jumps of the estimate from image to image can ask for more acceleration than hand and "
        f"joints may have: they used {100 * acceleration:.0f} % of the joints' limits at most, and "
        f"a limit of joints or hand was reached in {100 * min(limited):.1f} to "
        f"{100 * max(limited):.1f} % of the control periods of a run. At frequencies at which "
        "nothing moves the hand shows what this noise does to it.",
    )
    pairs = _halved(kept)
    if not pairs:
        return words
    off = [abs(half / whole - 1.0) for half, whole in pairs]
    return (
        *words,
        f"With all amplitudes halved the hand's gain differs by {100 * float(np.median(off)):.0f} "
        f"% as a median over frequencies and runs, and by {100 * max(off):.0f} % at most, from "
        "that of the run with the same seed (feed-forward, eyes follow). Noise is part of that, "
        "and weighs twice as much at half the amplitude.",
    )


def _halved(kept: Kept) -> list[tuple[float, float]]:
    """Pair the hand's gains with half the amplitudes with those of the same seed with the whole."""
    runs = {
        (case.seed, case.scale): row
        for case, row in kept
        if (case.feed_forward, case.eyes_follow) == VARIANTS[_BEST]
    }
    pairs: list[tuple[float, float]] = []
    for (seed, scale), row in runs.items():
        whole = runs.get((seed, 1.0))
        if scale != HALF or whole is None:
            continue
        for axis in AXES:
            half_of, whole_of = row.answer("hand", axis), whole.answer("hand", axis)
            if half_of is not None and whole_of is not None:
                gains = np.abs(half_of.ratio), np.abs(whole_of.ratio)
                pairs += zip(*(gain.tolist() for gain in gains), strict=True)
    return pairs


def _variants(settings: ResponseSettings, curves: Curves, signal: str) -> Table:
    highest = _highest(settings)
    rows = []
    for name in VARIANTS:
        for axis in AXES:
            bode = curves.get((name, signal, axis))
            if bode is not None:
                lag = _lag(bode.phase_at(settings.lag_hz)) if axis == "sideways" else ""
                rows.append(
                    (
                        name,
                        axis,
                        _hz(bode.bandwidth_hz, highest),
                        _hz(bode.faithful_hz, highest),
                        f"{bode.peak.words(2)} at {bode.peak_hz:.2g} Hz",
                        lag,
                    )
                )
    headings = (
        "variant",
        "object moves",
        "amplitude falls by 3 dB",
        "within 3 dB up to",
        "greatest ratio of amplitudes",
        f"lag at {settings.lag_hz:g} Hz",
    )
    return Table(headings, rows, "Medians, and in brackets the least and the greatest of all runs.")


def _draw(file: Path, title: str, curves: dict[str, dict[str, Bode]], caption: str) -> Picture:
    shown = {name: by_axis for name, by_axis in curves.items() if by_axis}
    write_whole(file, bode_png(title, shown))
    return Picture(file, caption)


def _by_axis(curves: Curves, variant: str, signal: str) -> dict[str, Bode]:
    found = {axis: curves.get((variant, signal, axis)) for axis in AXES}
    return {axis: bode for axis, bode in found.items() if bode is not None}


def _runs(curves: Curves) -> int:
    return len(curves[_BEST, "hand", "sideways"].gains)


def _highest(settings: ResponseSettings) -> float:
    return settings.base_hz * max(*settings.sideways_lines, *settings.depth_lines)


def _hz(spread: Spread, highest: float) -> str:
    return f"{spread.words(2, beyond=f'more than {highest:g}')} Hz"


def _lag(phase_deg: Spread) -> str:
    """Say a lag; the phase's least is the lag's greatest."""
    values = [
        None if one is None else -one for one in (phase_deg.middle, phase_deg.high, phase_deg.low)
    ]
    return f"{Spread(*values).words(1)} deg"


def _missed(bode: Bode, hz: float) -> str:
    place = int(np.argmin(np.abs(bode.hz - hz)))
    ratios = bode.gains[:, place] * np.exp(1j * np.radians(bode.phases_deg[:, place]))
    return f"{Spread.of(np.abs(ratios - 1.0).tolist()).words(1, 100.0)} %"

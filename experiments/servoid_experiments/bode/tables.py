"""Writes the numbers behind the figures as CSV."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from servoid.output import write_whole
from servoid_experiments.bode.margin import Loop
from servoid_experiments.bode.planning import MAPS
from servoid_experiments.bode.spread import Bode
from servoid_experiments.design import Done

Curves = Mapping[tuple[str, str, str], Bode]
"""What was heard, by variant, signal and axis."""


def write_responses(path: Path, curves: Curves) -> None:
    """Write gains and phases: a line for each variant, signal, axis and frequency.

    Raises:
        OutputError: the file cannot be written.

    """
    names = ("gain", "gain_low", "gain_high", "phase_deg", "phase_low_deg", "phase_high_deg")
    lines: list[Sequence[object]] = [("variant", "signal", "axis", "hz", *names, "runs")]
    for (variant, signal, axis), bode in curves.items():
        bands = [
            values
            for band in (bode.gain, bode.phase_deg)
            for values in (band.middle, band.low, band.high)
        ]
        for place, hz in enumerate(bode.hz):
            numbers = [f"{values[place]:.5g}" for values in bands]
            lines.append((variant, signal, axis, f"{hz:g}", *numbers, len(bode.gains)))
    _write(path, lines)


def write_margins(path: Path, done: Sequence[Done]) -> None:
    """Write where stability ends: a line for each loop, latency, rate and what was sought.

    Raises:
        OutputError: the file cannot be written.

    """
    lines: list[Sequence[object]] = [
        ("loop", "latency_s", "rate_hz", "sought", "edge", "swings_hz")
    ]
    for one in done:
        if one.row is not None:
            case, row = one.case, one.row
            lines.append(
                (
                    _name(case.loop),
                    f"{case.latency_s:g}",
                    f"{case.rate_hz:g}",
                    case.seeks,
                    "" if row.edge is None else f"{row.edge:.5g}",
                    "" if row.swings_hz is None else f"{row.swings_hz:.4g}",
                )
            )
    _write(path, lines)


def _name(loop: Loop) -> str:
    return next(name for name, (known, _) in MAPS.items() if known == loop)


def _write(path: Path, lines: Sequence[Sequence[object]]) -> None:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    write_whole(path, text.getvalue().encode())

"""Reports the stability margins of the loop, by latency and rate."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servoid.output import write_whole
from servoid.pose.exact import Floats
from servoid.servo import ServoSettings
from servoid_experiments.bode.drawing import MarginMap, maps_png
from servoid_experiments.bode.margin import DELAYS_S, GAINS, MarginCase, MarginRow
from servoid_experiments.bode.planning import MAPS
from servoid_experiments.bode.settings import MarginSettings
from servoid_experiments.design import Done
from servoid_experiments.report import Cell, Picture, Section, Table

Kept = Sequence[tuple[MarginCase, MarginRow]]

_TITLES = {
    "delay": "unknown delay that it withstands [ms]",
    "gain": "factor on its gains that it withstands",
}
_PAPER = "the paper's law, no time stamps"


def report_margins(settings: MarginSettings, done: Sequence[Done], folder: Path) -> list[Section]:
    """Draw the maps, with their numbers, and list the largest gains; nothing without trials.

    Raises:
        OutputError: a file cannot be written.

    """
    kept = [(one.case, one.row) for one in done if one.row is not None]
    if not kept:
        return []
    maps = {name: _values(settings, kept, name) for name in MAPS}
    picture = _draw(settings, maps, folder / "margins.png")
    tables = (_margins(kept), _greatest_gains(settings, maps[_PAPER]))
    return [Section("How much the loop withstands", (), (picture,), tables)]


def _values(settings: MarginSettings, kept: Kept, name: str) -> Floats:
    """Return margins (latencies, rates); inf is beyond what was tried, NaN unknown."""
    loop, seeks = MAPS[name]
    found = np.full((len(settings.latencies_s), len(settings.rates_hz)), np.nan)
    for case, row in kept:
        if (case.loop, case.seeks) == (loop, seeks):
            place = (
                settings.latencies_s.index(case.latency_s),
                settings.rates_hz.index(case.rate_hz),
            )
            found[place] = np.inf if row.edge is None else row.edge
    return found


def _margins(kept: Kept) -> Table:
    """List where stability ends, for each loop, latency, rate and sought quantity."""
    names = {loop: name for name, (loop, _) in reversed(MAPS.items())}
    rows: list[tuple[Cell, ...]] = []
    for case, row in kept:
        edge = "" if row.edge is None else f"{row.edge:.5g}"
        swings = "" if row.swings_hz is None else f"{row.swings_hz:.4g}"
        late, rate = f"{case.latency_s:g}", f"{case.rate_hz:g}"
        rows.append((names[case.loop], late, rate, case.seeks, edge, swings))
    return Table(
        "margins",
        "Unknown delay in s, or factor on both gains of the hand, at which stability ends, and the "
        "frequency at which the loop swings there; empty: beyond all that was tried.",
        ("loop", "latency_s", "rate_hz", "sought", "edge", "swings_hz"),
        rows,
    )


def _greatest_gains(settings: MarginSettings, edges: Floats) -> Table:
    """List which position gain to use at most where there are no time stamps."""
    gain = settings.share * ServoSettings().hand.position_gain
    rows: list[tuple[Cell, ...]] = [
        (1e3 * late, *(None if np.isnan(edge) else gain * float(edge) for edge in edges[place]))
        for place, late in enumerate(settings.latencies_s)
    ]
    return Table(
        "greatest_gains",
        "Without time stamps: the greatest servo.hand.position_gain to use, in 1/s, which is "
        f"{settings.share:g} times that at which a loop with the paper's law swings.",
        ("latency_ms", *(f"{rate:g} Hz" for rate in settings.rates_hz)),
        rows,
    )


def _draw(settings: MarginSettings, maps: dict[str, Floats], file: Path) -> Picture:
    shown = [
        MarginMap(
            title=f"{name}\n{_TITLES[seeks]}",
            unit="ms" if seeks == "delay" else "times",
            values=maps[name],
            scale=1e3 if seeks == "delay" else 1.0,
            beyond=f"> {1e3 * DELAYS_S[1]:g}" if seeks == "delay" else f"> {GAINS[1]:g}",
        )
        for name, (_, seeks) in MAPS.items()
    ]
    title = "What the loop withstands before it swings ever wider"
    write_whole(file, maps_png(title, settings.latencies_s, settings.rates_hz, shown))
    return Picture(
        file,
        "Delay that time stamps do not know of (four loops with time stamps), and factor on the "
        "hand's gains (a loop without), at which stability ends, by latency and rate.",
    )

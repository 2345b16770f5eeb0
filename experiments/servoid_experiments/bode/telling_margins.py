"""Says how far the loop is from instability, by latency and rate."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servoid.output import write_whole
from servoid.servo import ServoSettings
from servoid.servo.arm import Floats
from servoid.sim.arm_file import read_arm
from servoid.sim.world import CameraSettings
from servoid_experiments.bode.drawing import MarginMap, maps_png
from servoid_experiments.bode.margin import DELAYS_S, GAINS, SERVOID, MarginCase, MarginRow
from servoid_experiments.bode.planning import MAPS
from servoid_experiments.bode.settings import MarginSettings
from servoid_experiments.bode.spread import in_short
from servoid_experiments.bode.tables import write_margins
from servoid_experiments.design import Done
from servoid_experiments.findings import Picture, Section, Table

Kept = Sequence[tuple[MarginCase, MarginRow]]

_SOUGHT = {"delay": "unknown delay that it bears [ms]", "gain": "factor on its gains that it bears"}
_PAPER = "the paper's law, no time stamps"


def tell_margins(settings: MarginSettings, done: Sequence[Done], folder: Path) -> list[Section]:
    """Draw the maps and say what they show; nothing if no trial succeeded."""
    kept = [(one.case, one.row) for one in done if one.row is not None]
    if not kept:
        return []
    write_margins(folder / "margins.csv", done)
    maps = {name: _values(settings, kept, name) for name in MAPS}
    pictures = (_draw(settings, maps, folder / "margins.png"),)
    return [
        Section(
            "How much the loop bears",
            (*_gain_words(kept), *_delay_words(maps), *_phase_words(settings, kept)),
            (),
            pictures,
            (_gain_table(settings, maps[_PAPER]),),
        )
    ]


def _values(settings: MarginSettings, kept: Kept, name: str) -> Floats:
    """Return edges (latencies, rates); inf is beyond what was tried, NaN is not known."""
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


def _gain_words(kept: Kept) -> tuple[str, ...]:
    edges = [
        np.inf if row.edge is None else row.edge
        for case, row in kept
        if (case.loop, case.seeks) == (SERVOID, "gain")
    ]
    begins = (
        "Here no images are drawn: exact poses arrive late, at the cameras' rate, at the real "
        "controller, with an arm without physics whose joints' speeds lag by "
        f"{1e3 * read_arm().joints.lag_s:g} ms. A small step "
        "of the object shows if errors fade. The margin of gain is the factor on both gains of the "
        "hand, of position and turn, at which they no longer do; the margin of delay is the "
        "further delay that nobody told the loop of at which they no longer do, with the gains as "
        "they are set."
    )
    if not edges:
        return (begins,)
    return (
        begins,
        f"With time stamps the margin of gain is {_range(edges, GAINS[1])} at the corners of the "
        "map. A pose is put into the world by where the cameras were when the image was taken, so "
        "a resting object rests in the world however the hand moves, and the hand closes in by its "
        "joints' sensors: neither latency nor rate is part of the loop that leads it. They cost "
        "accuracy while the object moves.",
    )


def _delay_words(maps: dict[str, Floats]) -> tuple[str, ...]:
    words = [
        "That asks for time stamps that are right. A stamp that is wrong makes a hand or an eye "
        "that moves look like an object that moves, and the prediction feeds that back. How far "
        "stamps may be off:"
    ]
    for name, (_, seeks) in MAPS.items():
        known = maps[name][~np.isnan(maps[name])]
        if seeks == "delay" and known.size:
            words.append(f"{name}: {_range(1e3 * known, 1e3 * DELAYS_S[1])} ms.")
    return tuple(words)


def _phase_words(settings: MarginSettings, kept: Kept) -> tuple[str, ...]:
    """Say the margin of phase at the latency and rate that are nearest to the cameras' own."""
    late, rate = _usual(settings)
    for case, row in kept:
        is_usual = (case.latency_s, case.rate_hz) == (late, rate)
        if (
            is_usual
            and (case.loop, case.seeks) == (SERVOID, "delay")
            and row.edge
            and row.swings_hz
        ):
            return (
                f"At {1e3 * late:g} ms and {rate:g} Hz servoid with eyes that follow bears "
                f"{1e3 * row.edge:.0f} ms; there it swings at {row.swings_hz:.1f} Hz, where such a "
                f"delay is a margin of phase of {360.0 * row.swings_hz * row.edge:.0f} degrees.",
            )
    return ()


def _usual(settings: MarginSettings) -> tuple[float, float]:
    usual = CameraSettings()
    late = min(settings.latencies_s, key=lambda one: abs(one - usual.latency_s))
    return late, min(settings.rates_hz, key=lambda one: abs(one - usual.rate_hz))


def _gain_table(settings: MarginSettings, edges: Floats) -> Table:
    """Say which position gain to use at most where there are no time stamps."""
    hand = ServoSettings().hand
    gain = hand.position_gain
    rows = [
        (
            f"{1e3 * late:g} ms",
            *(_gain(settings.share * gain * edge) for edge in edges[place]),
        )
        for place, late in enumerate(settings.latencies_s)
    ]
    return Table(
        ("latency", *(f"{rate:g} Hz" for rate in settings.rates_hz)),
        rows,
        "Without time stamps: use at most this servo.hand.position_gain, in 1/s (and "
        f"{hand.turn_gain / gain:g} times as much turn_gain), which is {settings.share:g} times "
        f"the gain at which a loop with the paper's law swings. The default is {gain:g}.",
    )


def _draw(settings: MarginSettings, maps: dict[str, Floats], file: Path) -> Picture:
    shown = [
        MarginMap(
            title=f"{name}\n{_SOUGHT[seeks]}",
            unit="ms" if seeks == "delay" else "times",
            values=maps[name],
            scale=1e3 if seeks == "delay" else 1.0,
            beyond=f"> {1e3 * DELAYS_S[1]:g}" if seeks == "delay" else f"> {GAINS[1]:g}",
        )
        for name, (_, seeks) in MAPS.items()
    ]
    title = "What the loop bears before it swings ever wider"
    write_whole(file, maps_png(title, settings.latencies_s, settings.rates_hz, shown))
    return Picture(
        file,
        "Delay that time stamps do not know of (four loops with time stamps), and factor on the "
        "hand's gains (a loop without), at which stability ends, by latency and rate.",
    )


def _range(values: Sequence[float] | Floats, tried: float) -> str:
    """Say from where to where values go, of which those beyond all that was tried are inf."""
    low, high = (
        f"more than {tried:g}" if np.isinf(one) else f"{one:.0f}"
        for one in (min(values), max(values))
    )
    return low if low == high else f"{low} to {high}"


def _gain(value: float) -> str:
    if np.isnan(value):
        return "not known"
    return "any" if np.isinf(value) else in_short(value)

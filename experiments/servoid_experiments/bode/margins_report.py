"""Reports the stability margins of the loop, by latency and rate."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from servoid.batch import Done
from servoid.pose.exact import Floats
from servoid.servo import ServoSettings
from servoid.view.axes import new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.bode.margin import DELAYS_S, GAINS, MarginCase, MarginRow
from servoid_experiments.bode.plan import MAPS, MarginSettings
from servoid_experiments.design import Cell, Picture, Section, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Kept = Sequence[tuple[MarginCase, MarginRow]]

_SOUGHT = {
    "delay": ("unknown delay that it withstands [ms]", 1e3, 1e3 * DELAYS_S[1]),
    "gain": ("factor on its gains that it withstands", 1.0, GAINS[1]),
}
"""Title of a map, factor from a margin to its unit there, and the largest value tried in it."""

_DARK = 0.45  # share of a colour map below which letters on it are white
_PAPER = "the paper's law, no time stamps"


def report_margins(settings: MarginSettings, done: Sequence[Done]) -> list[Section]:
    """Draw the maps, and list their numbers and the largest gains; nothing without trials."""
    kept = [(one.case, one.row) for one in done if one.row is not None]
    if not kept:
        return []
    maps = {name: _values(settings, kept, name) for name in MAPS}
    tables = (_margins(kept), _greatest_gains(settings, maps[_PAPER]))
    heading = "How much the loop withstands"
    return [Section(heading, pictures=(_draw(settings, maps),), tables=tables)]


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
        ("loop", "latency_s", "rate_hz", "sought", "edge", "swings_hz"),
        rows,
        "Unknown delay in s, or factor on both gains of the hand, at which stability ends, and the "
        "frequency at which the loop swings there; empty: beyond all that was tried.",
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
        ("latency_ms", *(f"{rate:g} Hz" for rate in settings.rates_hz)),
        rows,
        "Without time stamps: the greatest servo.hand.position_gain to use, in 1/s, which is "
        f"{settings.share:g} times that at which a loop with the paper's law swings.",
    )


def _draw(settings: MarginSettings, maps: dict[str, Floats]) -> Picture:
    """Draw the maps, two in a row, with their values written into them."""
    figure = new_figure(9.6, 3.1 * ((len(maps) + 1) // 2) + 0.4)
    title = "What the loop withstands before it swings ever wider"
    figure.suptitle(title, x=0.02, ha="left", color=INK, fontsize=12)
    panels = list(figure.subplots((len(maps) + 1) // 2, 2, squeeze=False).flat)
    for axes, (name, values) in zip(panels, maps.items(), strict=False):
        seeks = MAPS[name][1]
        what, scale, beyond = _SOUGHT[seeks]
        alike = [scale * other.ravel() for key, other in maps.items() if MAPS[key][1] == seeks]
        _draw_map(axes, scale * values, np.concatenate(alike), f"> {beyond:g}")
        axes.set_title(f"{name}\n{what}", loc="left", color=INK, fontsize=10.5)
        rates, latencies_s = settings.rates_hz, settings.latencies_s
        axes.set_xticks(range(len(rates)), [f"{rate:g}" for rate in rates])
        axes.set_yticks(range(len(latencies_s)), [f"{1e3 * late:g}" for late in latencies_s])
        axes.set_xlabel("images a second [Hz]", color=INK, fontsize=10)
        axes.set_ylabel("latency [ms]", color=INK, fontsize=10)
    for axes in panels[len(maps) :]:
        axes.set_visible(False)
    return Picture(
        "margins",
        "Delay that time stamps do not know of (four loops with time stamps), and factor on the "
        "hand's gains (a loop without), at which stability ends, by latency and rate.",
        png(figure),
    )


def _draw_map(axes: "Axes", values: Floats, alike: Floats, beyond: str) -> None:
    """Draw values (latencies, rates) with a colour scale for all maps of its unit, of values (N,).

    `beyond` is the text for inf, which is beyond all that was tried; NaN is unknown.
    """
    known = alike[np.isfinite(alike) & (alike > 0.0)]
    low, high = (known.min(), known.max()) if known.size else (1.0, 1.0)
    # Ratios matter more than differences.
    span = max(np.log(high / low), 1e-9)
    shades = np.log(np.clip(values, low, high) / low) / span
    axes.imshow(shades, cmap="cividis", vmin=0.0, vmax=1.0, origin="lower", aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        if np.isnan(value):
            continue
        text = beyond if np.isinf(value) else f"{value:.{0 if value >= 10.0 else 1}f}"
        color = "white" if shades[row, column] < _DARK else "#111111"
        axes.text(column, row, text, ha="center", va="center", color=color, fontsize=10)
    axes.tick_params(colors=QUIET_INK, labelcolor=INK, labelsize=10, length=0)
    axes.spines[:].set_visible(False)

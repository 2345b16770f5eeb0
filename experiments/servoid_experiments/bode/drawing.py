"""Draws Bode diagrams and maps of margins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from servoid.pose.exact import Floats
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.bode.spread import Bode

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = {"sideways": "moved sideways", "depth": "moved in depth"}

_WIDE_IN, _HIGH_IN = 9.6, 6.4
_BLUE, _RED, _SKY, _ORANGE = DISTINCT[0], DISTINCT[1], DISTINCT[5], DISTINCT[4]
_STYLES = ((_BLUE, "-"), (_SKY, "--"), (_RED, "-"), (_ORANGE, "--"))
_FEWEST_DB, _MOST_DB = -12.0, 12.0
_TICKS_HZ = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_DARK = 0.45  # share of a colour map below which letters on it are white


def bode_png(title: str, curves: Mapping[str, Mapping[str, Bode]]) -> bytes:
    """Return a PNG file: gain above phase, a column for each axis, a line for each name.

    `curves` are by name, then by axis; a name may lack an axis. Bands span all runs.
    """
    figure = new_figure(_WIDE_IN, _HIGH_IN)
    figure.suptitle(title, x=0.02, ha="left", color=INK, fontsize=12)
    panels = figure.subplots(2, len(AXES), sharex=True, sharey="row", squeeze=False)
    for column, (axis, what) in enumerate(AXES.items()):
        above, below = panels[:, column]
        above.axhspan(-3.0, 3.0, color="#f0efec", linewidth=0)
        below.axhline(0.0, color="#aaaaaa", linewidth=0.8)
        for place, (name, by_axis) in enumerate(curves.items()):
            if axis in by_axis:
                color, style = _STYLES[place % len(_STYLES)]
                _draw(above, below, by_axis[axis], (name, color, style))
        above.set_title(what, loc="left", color=INK, fontsize=11)
        below.set_xlabel("frequency [Hz]", color=INK, fontsize=10.5)
    _name_axes(panels[0, 0], panels[1, 0])
    for axes in panels.flat:
        dress(axes)
        axes.grid(axis="x", color="#e6e6e6", linewidth=0.8)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2, frameon=False, fontsize=10)
    return png(figure)


def _draw(above: "Axes", below: "Axes", bode: Bode, look: tuple[str, str, str]) -> None:
    name, color, style = look
    decibels = [20.0 * np.log10(part) for part in (bode.gain.low, bode.gain.middle, bode.gain.high)]
    phases = (bode.phase_deg.low, bode.phase_deg.middle, bode.phase_deg.high)
    for axes, (low, middle, high) in ((above, decibels), (below, phases)):
        axes.fill_between(bode.hz, low, high, color=color, alpha=0.18, linewidth=0)
        axes.plot(
            bode.hz,
            middle,
            style,
            color=color,
            linewidth=1.8,
            marker="o",
            markersize=3.2,
            label=name,
        )


def _name_axes(above: "Axes", below: "Axes") -> None:
    above.set_xscale("log")
    low, high = above.get_ylim()
    above.set_ylim(max(low, _FEWEST_DB), min(high, _MOST_DB))
    above.set_ylabel("gain [dB]", color=INK, fontsize=10.5)
    below.set_ylabel("phase [deg]", color=INK, fontsize=10.5)
    first, last = below.get_xlim()
    ticks = [hz for hz in _TICKS_HZ if first <= hz <= last]
    below.set_xticks(ticks, [f"{hz:g}" for hz in ticks])
    below.minorticks_off()


@dataclass(frozen=True, eq=False)
class MarginMap:
    """Values (latencies, rates) to draw; inf is beyond all that was tried, NaN unknown.

    `scale` converts them to `unit`, and `beyond` is the text for inf.
    """

    title: str
    unit: str
    values: Floats
    scale: float
    beyond: str


def maps_png(
    title: str, latencies_s: Sequence[float], rates_hz: Sequence[float], maps: Sequence[MarginMap]
) -> bytes:
    """Return a PNG file with the maps, two in a row, with their values written into them."""
    rows = (len(maps) + 1) // 2
    figure = new_figure(_WIDE_IN, 3.1 * rows + 0.4)
    figure.suptitle(title, x=0.02, ha="left", color=INK, fontsize=12)
    panels = list(figure.subplots(rows, 2, squeeze=False).flat)
    for axes, one in zip(panels, maps, strict=False):
        alike = [other.scale * other.values.ravel() for other in maps if other.unit == one.unit]
        _draw_map(axes, one, np.concatenate(alike))
        axes.set_xticks(range(len(rates_hz)), [f"{rate:g}" for rate in rates_hz])
        axes.set_yticks(range(len(latencies_s)), [f"{1e3 * late:g}" for late in latencies_s])
        axes.set_xlabel("images a second [Hz]", color=INK, fontsize=10)
        axes.set_ylabel("latency [ms]", color=INK, fontsize=10)
    for axes in panels[len(maps) :]:
        axes.set_visible(False)
    return png(figure)


def _draw_map(axes: "Axes", one: MarginMap, alike: Floats) -> None:
    """Draw a map with a colour scale that is shared by all maps of its unit, of all values (N,)."""
    values = one.scale * one.values
    known = alike[np.isfinite(alike) & (alike > 0.0)]
    low, high = (known.min(), known.max()) if known.size else (1.0, 1.0)
    # Ratios matter more than differences.
    span = max(np.log(high / low), 1e-9)
    shades = np.log(np.clip(values, low, high) / low) / span
    axes.imshow(shades, cmap="cividis", vmin=0.0, vmax=1.0, origin="lower", aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        if np.isnan(value):
            continue
        text = one.beyond if np.isinf(value) else f"{value:.{0 if value >= 10.0 else 1}f}"
        color = "white" if shades[row, column] < _DARK else "#111111"
        axes.text(column, row, text, ha="center", va="center", color=color, fontsize=10)
    axes.set_title(one.title, loc="left", color=INK, fontsize=10.5)
    axes.tick_params(colors=QUIET_INK, labelcolor=INK, labelsize=10, length=0)
    axes.spines[:].set_visible(False)

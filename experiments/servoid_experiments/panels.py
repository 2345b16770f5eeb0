"""Small multiples: one panel per factor, a line with a band over the seeds for each series."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from servoid.view.axes import dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.design import Picture, Table
from servoid_experiments.stats import Spread
from servoid_experiments.sweep import Curve, Panel, Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BANDS = (
    "One panel a factor, all else as in the centre. Lines are the median over the seeds, bands "
    "reach from the lowest to the highest."
)
_WIDE_IN, _HIGH_IN = 9.6, 2.35
_COLUMNS = 3
_TITLE_LETTERS = 24  # per line beside an axis
_MOST_TICKS = 7
_IN_LEGEND = 6
_BESIDE = 0.13  # of the distance between names: the offset of values that are side by side


@dataclass(frozen=True)
class Scale:
    """The vertical axis of all panels: its name with the unit, and its range."""

    title: str
    low: float | None = None
    high: float | None = None
    log: bool = False


def picture_of(
    panels: Sequence[Panel], scale: Scale, name: str, figure: str, caption: str
) -> Picture:
    """Return a picture of panels, and their numbers, of which `figure` is the heading."""
    numbers = panels_table(panels, name, figure)
    return Picture(name, f"{caption} {_BANDS}", draw_panels(panels, scale), numbers)


def draw_panels(panels: Sequence[Panel], scale: Scale) -> bytes:
    """Draw panels in a grid; return the bytes of the PNG file."""
    rows = -(-len(panels) // _COLUMNS)
    figure = new_figure(_WIDE_IN, _HIGH_IN * rows + 0.7)
    grid = figure.subplots(rows, _COLUMNS, sharey=True, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        _draw_panel(axes, panel)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    if scale.log:
        _set_log(grid[0])
    grid[0].set_ylim(scale.low, scale.high)
    for place in range(0, len(panels), _COLUMNS):
        # Panels are low: a longer title would overlap that of the next row.
        title = textwrap.fill(scale.title, _TITLE_LETTERS)
        grid[place].set_ylabel(title, color=INK, fontsize=10)
    known = {
        handle.get_label(): handle
        for axes in grid[: len(panels)]
        for handle in axes.get_lines()
        if not str(handle.get_label()).startswith("_")
    }
    figure.legend(
        known.values(),
        list(known),
        loc="outside upper left",
        ncols=min(_IN_LEGEND, len(known)),
        frameon=False,
        fontsize=10,
    )
    return png(figure)


def _draw_panel(axes: "Axes", panel: Panel) -> None:
    dress(axes)
    values = panel.values
    places = {
        value: float(value) if isinstance(value, float | int) and not panel.has_names else place
        for place, value in enumerate(values)
    }
    for center in panel.centers:
        axes.axvline(
            places[center], color="#999999", linewidth=1.4, linestyle=":", label="the centre"
        )
    for index, curve in enumerate(panel.curves):
        pairs = zip(curve.values, curve.spreads, strict=True)
        known = [(places[value], spread) for value, spread in pairs if spread is not None]
        aside = _BESIDE * (index - 0.5 * (len(panel.curves) - 1)) if panel.has_names else 0.0
        _draw_curve(axes, curve, [(place + aside, spread) for place, spread in known], panel)
    unit = f" [{panel.factor.unit}]" if panel.factor.unit else ""
    axes.set_title(f"{panel.factor.title}{unit}", loc="left", color=INK, fontsize=10.5)
    if panel.note:
        axes.set_xlabel(panel.note, color=QUIET_INK, fontsize=9.5, loc="left", labelpad=1.0)
    if panel.has_names:
        axes.set_xlim(-0.5, len(values) - 0.5)
        axes.set_xticks(range(len(values)), [written(value) for value in values])
    else:
        _set_ticks(axes, panel)


def _draw_curve(
    axes: "Axes", curve: Curve, known: Sequence[tuple[float, Spread]], panel: Panel
) -> None:
    places = [place for place, _ in known]
    low, middle, high = (
        [getattr(spread, name) for _, spread in known] for name in ("low", "middle", "high")
    )
    joined = "none" if panel.has_names else curve.style
    axes.plot(
        places,
        middle,
        color=curve.color,
        linestyle=joined,
        marker="o",
        markersize=4.0,
        linewidth=1.6,
        markerfacecolor=curve.color if curve.style == "-" else "white",
        label="_" if panel.has_names or curve.style != "-" else curve.name,
    )
    if panel.has_names:
        axes.vlines(places, low, high, color=curve.color, linewidth=1.6)
    elif curve.style == "-":
        axes.fill_between(places, low, high, color=curve.color, alpha=0.16, linewidth=0)


def _set_log(axes: "Axes") -> None:
    """Make the vertical axis logarithmic, with plain numbers as tick labels."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _set_ticks(axes: "Axes", panel: Panel) -> None:
    """Label the tried values, as far as there is room."""
    from matplotlib.ticker import NullLocator

    numbers = [value for value in panel.values if isinstance(value, float | int)]
    if panel.factor.log:
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
    kept = far_apart(numbers, panel.factor.log)
    axes.set_xticks(kept, [written(value) for value in kept])


def far_apart(numbers: Sequence[float], log: bool) -> list[float]:
    """Return numbers whose labels do not overlap, including the first and the last."""
    at = [math.log(number) if log else number for number in numbers]
    room = (at[-1] - at[0]) / _MOST_TICKS
    kept = [len(at) - 1]
    for index in range(len(at) - 2, 0, -1):
        if min(at[kept[-1]] - at[index], at[index] - at[0]) >= room:
            kept.append(index)
    return [numbers[index] for index in sorted({0, *kept})]


def written(value: Value) -> str:
    """Format a value of a factor."""
    if isinstance(value, Enum):
        return str(value.value)
    return value.replace("_", "\n") if isinstance(value, str) else f"{value:g}"


def panels_table(panels: Sequence[Panel], name: str, figure: str) -> Table:
    """Return the numbers in panels: a row for each value of each curve.

    `figure` names the number; `seeds_low` and `seeds_high` are the extremes over the seeds.
    """
    head = ("factor", "unit", "value", "series", "variant", figure, "seeds_low", "seeds_high")
    rows = [
        (
            panel.factor.title,
            panel.factor.unit,
            written(value).replace("\n", "_"),
            curve.name,
            panel.note if curve.style != "-" else "",
            *(spread.middle, spread.low, spread.high),
        )
        for panel in panels
        for curve in panel.curves
        for value, spread in zip(curve.values, curve.spreads, strict=True)
        if spread is not None
    ]
    return Table(name, head, rows)

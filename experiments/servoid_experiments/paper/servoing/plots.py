"""Figures of the paper's servoing: time courses as in the paper, and the effect of each change."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from servoid.pose.exact import Floats
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.design import Picture, Table
from servoid_experiments.drawing import dress_across, legend_below
from servoid_experiments.paper.servoing.followed import Courses
from servoid_experiments.stats import Spread, interval_cells, interval_headings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HAND, _SEEN = DISTINCT[0], DISTINCT[1]
_ROOM = 1.08
_LEAST_MM = 5.0  # half the height of a panel across the motion
_AXES = "xyz"


Column = tuple[str, Courses]
"""A column of panels: its heading, and the courses of one run."""


def draw_courses(
    columns: Sequence[Column], name: str, caption: str, until_s: float = math.inf
) -> Picture:
    """Draw x, y and z of target, recognition and hand over time, a column for each run."""
    figure = new_figure(9.6, 6.6)
    panels = figure.subplots(3, len(columns), sharey="row", sharex="col", squeeze=False)
    across = max(_LEAST_MM, *(_greatest(one, axis) for _, one in columns for axis in "yz"))
    for place, (heading, courses) in enumerate(columns):
        for axes, axis in zip(panels[:, place], _AXES, strict=True):
            _draw_along(axes, courses, axis)
            axes.set_xlim(0.0, min(courses.seconds[-1], until_s))
            if axis != "x":
                axes.set_ylim(-across, across)
        panels[0, place].set_title(heading, loc="left", color=INK, fontsize=11)
        panels[-1, place].set_xlabel("seconds since the object moves", color=INK, fontsize=10)
    for axes, axis in zip(panels[:, 0], _AXES, strict=True):
        axes.set_ylabel(f"{axis} in M0 [mm]", color=INK, fontsize=10)
    legend_below(figure, *panels[0, 0].get_legend_handles_labels(), columns=3)
    keys = Courses.__struct_fields__
    head = ("run", *(key if key == "seconds" else f"{key}_m" for key in keys))
    rows = [
        (heading, *instant)
        for heading, courses in columns
        for instant in zip(*(getattr(courses, key) for key in keys), strict=True)
    ]
    return Picture(name, caption, png(figure), Table(name, head, rows))


def _draw_along(axes: "Axes", courses: Courses, axis: str) -> None:
    """Draw the three courses along an axis."""
    lines = (
        ("seen", _SEEN, "-", 1.1, "recognised"),
        ("hand", _HAND, "-", 1.8, "hand"),
        ("target", INK, "--", 1.1, "target"),
    )
    for what, color, style, width, label in lines:
        values = 1000.0 * courses.along(what, axis)
        axes.plot(courses.seconds, values, style, color=color, linewidth=width, label=label)
    dress(axes)


def _greatest(courses: Courses, axis: str) -> float:
    """Return the largest shown magnitude along an axis in mm, with a margin."""
    values = [np.abs(courses.along(what, axis)).max() for what in ("target", "seen", "hand")]
    return _ROOM * 1000.0 * float(max(values))


@dataclass(frozen=True)
class Bar:
    """The results of a method: spread of the recognised z and x, and lag of the hand.

    In millimetres and degrees. `group` bars are drawn together, with a gap after them.
    """

    name: str
    group: int
    spreads: tuple[Spread, Spread, Spread]


def draw_changes(bars: Sequence[Bar], name: str, caption: str) -> Picture:
    """Draw the effect of each change of the paper's method, with intervals."""
    figure = new_figure(9.6, 0.36 * len(bars) + 1.3)
    panels = figure.subplots(1, 3, sharey=True)
    heights = -np.array([index + 0.7 * one.group for index, one in enumerate(bars)])
    titles = ("recognised z:\nspread [mm]", "recognised x:\nspread [mm]", "hand:\nphase lag [deg]")
    for place, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        _draw_intervals(axes, heights, [one.spreads[place] for one in bars])
        axes.set_title(title, loc="left", color=INK, fontsize=10)
    panels[0].set_yticks(heights, [one.name for one in bars])
    head = ("method", *interval_headings(("z_spread_mm", "x_spread_mm", "lag_deg")))
    rows = [(one.name, *interval_cells(one.spreads)) for one in bars]
    return Picture(name, caption, png(figure), Table(name, head, rows))


def _draw_intervals(axes: "Axes", heights: Floats, values: Sequence[Spread]) -> None:
    """Draw means and intervals at heights (N,); a dashed line is at the first mean."""
    means = np.array([value.mean for value in values])
    halves = np.array([value.half or 0.0 for value in values])
    # A spread cannot be below 0, however few runs there are.
    below = np.minimum(halves, means) if (means >= 0.0).all() else halves
    axes.axvline(means[0], color=QUIET_INK, linewidth=0.9, linestyle="--")
    axes.errorbar(
        means, heights, xerr=(below, halves), fmt="o", color=_HAND, capsize=3, markersize=5
    )
    least, most = float((means - below).min()), float((means + halves).max())
    axes.set_xlim(min(0.0, least - 0.05 * most), 1.05 * most)
    axes.axvline(0.0, color="#aaaaaa", linewidth=0.8)
    dress_across(axes)

"""Plots the drift of the rotation against the total rotation."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid.view.track.turning import Cause, Turning

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKS = {Cause.KNOWN_SIDE: ("v", DISTINCT[1]), Cause.ADJUSTED: ("D", DISTINCT[2])}
_MOST_NAMED = 12  # corrections labelled with their size, the largest
_LEAST_SPAN_DEG = 10.0
_SHADE = "#e4e0d8"


def draw_turning(turning: Turning, tracked: NDArray[np.bool_]) -> bytes:
    """Draw the angle from the first view and the drift; return the PNG file's bytes.

    `tracked` (N,) is true where the images confirm the pose.
    """
    figure = new_figure(9.6, 5.4)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.7))
    along = np.degrees(turning.turned)
    for axes in (upper, lower):
        _shade(axes, along, tracked)
    upper.plot(along, np.degrees(turning.away), color=DISTINCT[0], linewidth=1.6)
    upper.set_ylim(0.0, 185.0)
    upper.set_yticks([0, 90, 180])
    upper.set_title("rotation from the first view [deg]", loc="left", color=INK, fontsize=10.5)
    _deviations(lower, along, turning)
    _corrections(lower, along, turning)
    lower.set_xlim(0.0, max(_LEAST_SPAN_DEG, float(along.max(initial=0.0))))
    lower.set_xlabel("total rotation [deg]", color=INK, fontsize=10)
    for axes in (upper, lower):
        dress(axes)
    _legend(lower)
    return png(figure)


def _deviations(axes: "Axes", along: Floats, turning: Turning) -> None:
    lines = [
        ("drift since the first image", turning.drift, DISTINCT[0], "-"),
        ("rotation, about its worst axis", turning.deviation, DISTINCT[4], "--"),
    ]
    for name, values, color, style in lines:
        if np.isfinite(values).any():
            # Where the object is not located, they are meaningless and may be very large.
            shown = np.where(turning.located, np.degrees(values), np.nan)
            axes.plot(along, shown, style, color=color, linewidth=1.6, label=name)
    if not np.isfinite(turning.drift).any():
        axes.text(
            0.5, 0.92, "drift unknown", transform=axes.transAxes, ha="center", color=QUIET_INK
        )
    axes.set_title("one standard deviation [deg]", loc="left", color=INK, fontsize=10.5)
    axes.set_ylim(bottom=0.0)
    axes.margins(y=0.18)
    axes.autoscale_view(scalex=False)
    axes.set_ylim(bottom=0.0)


def _corrections(axes: "Axes", along: Floats, turning: Turning) -> None:
    """Mark where the rotation was corrected, at the drift reported before it."""
    before = drift_before(turning)
    largest = sorted(turning.corrections, key=lambda one: -one.angle)[:_MOST_NAMED]
    for cause, (marker, color) in MARKS.items():
        own = [one for one in turning.corrections if one.cause is cause]
        if not own:
            continue
        places = [one.place for one in own]
        axes.plot(
            along[places],
            before[places],
            marker,
            color=color,
            markersize=8,
            markeredgecolor="white",
            label=f"{cause.value}: corrected",
            clip_on=False,
            zorder=4,
        )
    for one in largest:
        axes.annotate(
            f"{np.degrees(one.angle):.1f}°",
            (along[one.place], before[one.place]),
            (6, 5),
            textcoords="offset points",
            color=INK,
            fontsize=9,
        )


def drift_before(turning: Turning) -> Floats:
    """Return the last drift in degrees (N,) reported before each observation, 0 if none was."""
    known, last = [], 0.0
    for drift, located in zip(turning.drift, turning.located, strict=True):
        known.append(last)
        if located and np.isfinite(drift):
            last = float(np.degrees(drift))
    return np.array(known, dtype=np.float64)


def _shade(axes: "Axes", along: Floats, tracked: NDArray[np.bool_]) -> None:
    """Shade the angles at which the object was not tracked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], tracked, [True]]).astype(int)))
    for first, end in edges.reshape(-1, 2):
        low, high = along[max(0, first - 1)], along[min(end, len(along) - 1)]
        label = "not tracked" if first == edges[0] else ""
        axes.axvspan(low, max(high, low + 0.5), color=_SHADE, linewidth=0, label=label)


def _legend(axes: "Axes") -> None:
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.2),
        ncols=3,
        frameon=False,
        fontsize=9.5,
        handlelength=1.8,
    )

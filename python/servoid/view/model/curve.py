"""Draws the curve: fitness and silhouette IoU against the count of ellipsoids."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from servoid.model import ModelResult
from servoid.view.axes import dress, new_figure, png
from servoid.view.page import INK
from servoid.view.scores import UNUSED_COLOR, USED_COLOR

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FITNESS_COLOR = (90, 90, 90)
_TEXT_PT = 8.5  # the size of the page's text where the picture has its full width
_Line = tuple[str, NDArray[np.float64], tuple[int, int, int], str]


def draw_curve(result: ModelResult) -> bytes:
    """Draw F and the mean silhouette IoU against the count, and return the PNG file's bytes."""
    ious = result.iou_by_count
    fitness = np.array([step.fitness for step in result.steps])
    lines: list[_Line] = [
        # Wide and pale, so that it stays visible under another line.
        ("fitness F", fitness, _FITNESS_COLOR, "s"),
        ("IoU, used views", ious.used, USED_COLOR, "o"),
        ("IoU, unused views", ious.unused, UNUSED_COLOR, "^"),
    ]
    lines = [line for line in lines if np.isfinite(line[1]).any()]
    figure = new_figure(7.2, 4.4)
    axes = figure.add_subplot()
    for _, values, color, marker in lines:
        wide = marker == "s"
        axes.plot(
            ious.counts,
            values,
            "--" if marker == "^" else "-",
            color=(*_unit(color), 0.4 if wide else 1.0),
            linewidth=6.0 if wide else 1.8,
            marker=marker,
            markersize=8.0 if wide else 4.5,
        )
    _label(axes, int(ious.counts[-1]), lines)
    _name(axes)
    return png(figure)


def _label(axes: "Axes", last_count: int, lines: list[_Line]) -> None:
    """Label each line at its end with its name and its last value."""
    low, high = _span([values for _, values, _, _ in lines])
    axes.set_ylim(low, high)
    ends = np.array([values[-1] for _, values, _, _ in lines])
    for (name, values, color, _), place in zip(
        lines, spread(ends, 0.062 * (high - low)), strict=True
    ):
        axes.annotate(
            f"{name}  {values[-1]:.3f}",
            (last_count, float(place)),
            (10, 0),
            textcoords="offset points",
            va="center",
            color=_unit(color),
            fontsize=_TEXT_PT,
            annotation_clip=False,
        )


def _name(axes: "Axes") -> None:
    """Label and style the axes."""
    from matplotlib.ticker import MaxNLocator

    axes.set_xlabel("ellipsoids", color=INK, fontsize=_TEXT_PT)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    dress(axes)
    axes.tick_params(labelsize=_TEXT_PT)


def spread(places: NDArray[np.float64], gap: float) -> NDArray[np.float64]:
    """Return positions (N,), moved as little as needed to be at least `gap` apart, in order."""
    order = np.argsort(places, kind="stable")
    steps = gap * np.arange(len(places))
    # With the steps subtracted, the positions must not decrease: pool adjacent violators.
    pools: list[list[float]] = []
    for place in places[order] - steps:
        pools.append([float(place)])
        while len(pools) > 1 and np.mean(pools[-2]) > np.mean(pools[-1]):
            last = pools.pop()
            pools[-1] += last
    moved = np.concatenate([np.full(len(pool), np.mean(pool)) for pool in pools]) + steps
    return moved[np.argsort(order, kind="stable")]


def _span(lines: list[NDArray[np.float64]]) -> tuple[float, float]:
    """Return the range of values to show, rounded outwards to a tenth."""
    values = np.concatenate(lines)
    values = values[np.isfinite(values)]
    low = np.floor(10.0 * (values.min() - 0.02)) / 10.0
    high = np.ceil(10.0 * (values.max() + 0.005)) / 10.0
    return float(low), float(min(high, 1.0) if values.max() <= 1.0 else high)


def _unit(color: tuple[int, int, int]) -> tuple[float, float, float]:
    return color[0] / 255, color[1] / 255, color[2] / 255

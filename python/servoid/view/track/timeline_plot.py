"""Draws the timeline: status, confidence, notices and time per step for each observation."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from servoid.pose import Floats
from servoid.track import Tracked
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid.words import by_kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STATES = ("tracking", "located", "searching", "lost")
"""The states of an estimate; a located one is searching, but its position is confirmed."""

_COLORS = dict(zip(STATES, (DISTINCT[0], DISTINCT[5], DISTINCT[4], DISTINCT[1]), strict=True))
_LABELS = {"located": "searching, located"}
_MOST_NOTICES = 6
_LANE_IN = 0.3


def draw_timeline(tracked: Sequence[Tracked], on_all: Sequence[str] = ()) -> bytes:
    """Draw the result of each observation; return the PNG file's bytes.

    The notices `on_all` hold for every observation.
    """
    always = {words: [one.estimate.time_s for one in tracked] for words in on_all}
    notices = always | notice_times(tracked)
    heights = [0.3 + _LANE_IN * len(STATES), 1.5, 0.3 + 0.42 * max(1, len(notices)), 1.7]
    figure = new_figure(9.6, sum(heights) + 0.7)
    status, confidence, noticed, spent = figure.subplots(4, 1, sharex=True, height_ratios=heights)
    times = np.array([one.estimate.time_s for one in tracked])
    _draw_status(status, tracked, times)
    _draw_confidence(confidence, tracked, times)
    _draw_notices(noticed, notices)
    _draw_spent(spent, tracked, times)
    if len(times) > 1:
        spent.set_xlim(float(times[0]), float(times[-1]) + _usual_step(times))
    spent.set_xlabel("time [s]", color=INK, fontsize=10)
    return png(figure)


def notice_times(tracked: Sequence[Tracked]) -> dict[str, list[float]]:
    """Return the times of each kind of notice, the most frequent first.

    Notices that differ only in their numbers are of one kind, named with the range of each number.
    """
    said = ((notice, one.estimate.time_s) for one in tracked for notice in one.notices)
    return dict(by_kind(said)[:_MOST_NOTICES])


def _draw_status(axes: "Axes", tracked: Sequence[Tracked], times: Floats) -> None:
    """Draw a lane for each state, so that the plot does not depend on colours."""
    states = [one.state for one in tracked]
    ends = np.append(times[1:], times[-1] + _usual_step(times))
    for lane, state in enumerate(STATES):
        spans = [(times[first], ends[last] - times[first]) for first, last in _runs(states, state)]
        axes.broken_barh(spans, (lane - 0.4, 0.8), color=_COLORS[state], linewidth=0.3)
    axes.set_yticks(range(len(STATES)), [_LABELS.get(state, state) for state in STATES])
    axes.set_ylim(len(STATES) - 0.5, -0.5)
    _title(axes, "status")


def _runs(states: Sequence[str], state: str) -> list[tuple[int, int]]:
    """Return the first and the last index of each run of one state."""
    inside = np.concatenate([[False], [one == state for one in states], [False]])
    edges = np.flatnonzero(inside[1:] != inside[:-1])
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def _draw_confidence(axes: "Axes", tracked: Sequence[Tracked], times: Floats) -> None:
    confidence = [one.estimate.confidence for one in tracked]
    axes.plot(times, confidence, color=DISTINCT[0], linewidth=1.3)
    axes.set_ylim(-0.05, 1.05)  # a line along 0 is seen
    right = "within 20 mm or a tenth of the diameter, and 15 degrees"
    _title(axes, f"confidence: the probability that the pose is right, {right}")


def _draw_notices(axes: "Axes", notices: dict[str, list[float]]) -> None:
    """Draw a lane for each kind of notice, below its text."""
    for lane, (words, when) in enumerate(notices.items()):
        axes.plot(when, np.full(len(when), lane + 0.25), "|", color=DISTINCT[1], markersize=7)
        label = words if len(words) <= 110 else words[:109] + "…"
        axes.text(
            0.005,
            lane - 0.18,
            f"{label} ({len(when)})",
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=8.5,
            color=INK,
            parse_math=False,
        )
    if not notices:
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", color=QUIET_INK)
    _title(axes, "notices")
    axes.set_ylim(max(1, len(notices)) - 0.4, -0.6)
    axes.set_yticks([])


def _draw_spent(axes: "Axes", tracked: Sequence[Tracked], times: Floats) -> None:
    """Draw the computing time of each step, without the start."""
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    steps = 1e3 * np.array([one.seconds for one in tracked[1:]])
    axes.plot(times[1:], steps, ".", color=DISTINCT[0], markersize=3.5, label="a step")
    grown = np.array([one.evolved for one in tracked[1:]], np.bool_)
    if grown.any():
        style = {"color": DISTINCT[1], "markersize": 5, "label": "body evolved"}
        axes.plot(times[1:][grown], steps[grown], "^", **style)
    _title(axes, "computing time, without reading the images [ms]")
    if len(steps) and steps.min() > 0.0:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(numticks=8))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter("")
    if len(steps):
        axes.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 0.98),
            frameon=False,
            fontsize=9,
            ncols=2,
            handlelength=1.0,
            borderpad=0.0,
        )


def _title(axes: "Axes", words: str) -> None:
    axes.set_title(words, loc="left", color=INK, fontsize=10.5)
    dress(axes)


def _usual_step(times: Floats) -> float:
    return float(np.median(np.diff(times))) if len(times) > 1 else 1.0

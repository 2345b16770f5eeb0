"""Plots a servo run: errors of the hand, joints and gaze.

Shaded times are those in which the hand was held.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from servoid.output import write_together
from servoid.pose import Floats
from servoid.servo import ServoLog, holds
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_WIDE_IN, _PANEL_IN = 9.6, 2.15
_ZOOM = 4.0  # errors that fall by this factor get a panel of their own
_ROOM = 1.25
_SHADE = "#e4e0d8"
_BAND = "band"  # desired values: wide and pale, so that they stay visible below the actual ones
# Joints differ by their dashes as well as their colours; lengths on and off, in points.
_PATTERNS: dict[str, str | tuple[float, tuple[float, ...]]] = {
    _BAND: "-",
    "-": "-",
    "--": "--",
    "long": (0.0, (7.0, 2.0)),
    "short": (0.0, (2.5, 1.2)),
    "long short": (0.0, (7.0, 1.5, 1.5, 1.5)),
    "dots": (0.0, (1.0, 1.0)),
    "long dots": (0.0, (7.0, 1.5, 1.0, 1.0, 1.0, 1.5)),
    "apart": (0.0, (4.0, 4.0)),
}
_DASHES = ("-", "long", "short", "long short", "dots", "long dots", "apart")


@dataclass(frozen=True, eq=False)
class Line:
    """Values (T,) over times (T,) in seconds, with a name for the legend."""

    name: str
    times: Floats
    values: Floats
    color: str
    style: str = "-"


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines over a common time; `reach` bounds the values that are shown, from -reach to reach."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    reach: float | None = None

    @property
    def has_values(self) -> bool:
        """Return whether any line has a value."""
        return any(np.isfinite(line.values).any() for line in self.lines)


def draw_servo_plots(log: ServoLog, folder: str | Path, *, settle_s: float = 0.0) -> list[Path]:
    """Write `hand.png`, `joints.png` and `gaze.png` into a folder, and return their paths.

    Errors after `settle_s` seconds of servoing get an enlarged panel if they are much smaller than
    those before. The folder must exist.

    Raises:
        OutputError: a file cannot be written; then none changes.

    """
    folder = Path(folder)
    pages: dict[str, Callable[[], list[Panel]]] = {
        "hand.png": lambda: hand_panels(log, settle_s),
        "joints.png": lambda: joint_panels(log),
        "gaze.png": lambda: gaze_panels(log, settle_s),
    }
    marks = {"hand.png": settle_s, "gaze.png": settle_s}
    files = {
        folder / name: _draw(log, panels(), marks.get(name, 0.0)) for name, panels in pages.items()
    }
    write_together(files)
    return list(files)


def hand_panels(log: ServoLog, settle_s: float) -> list[Panel]:
    """Return the hand's position and rotation errors, and its and the target's displacement."""
    times, errors = log.times, log.hand_errors
    apart = _lines(times, 1000.0 * errors[:, :3], ("x", "y", "z"))
    turn = np.degrees(np.linalg.norm(errors[:, 3:], axis=1))
    return [
        _moved(log),
        *_with_zoom(
            "repeatability, position of the hand in its goal's frame", "mm", apart, settle_s
        ),
        *_with_zoom(
            "repeatability, rotation of the hand", "deg", [_line("angle", times, turn)], settle_s
        ),
        *_true_panels(log, settle_s),
    ]


def _true_panels(log: ServoLog, settle_s: float) -> list[Panel]:
    """Return the hand's errors from its goal at the true object, if the truth is known."""
    errors = log.true_errors
    if not np.isfinite(errors).any():
        return []
    apart = _lines(log.times, 1000.0 * errors[:, :3], ("x", "y", "z"))
    turn = np.degrees(np.linalg.norm(errors[:, 3:], axis=1))
    return [
        *_with_zoom("accuracy, position of the hand at the true object", "mm", apart, settle_s),
        *_with_zoom(
            "accuracy, rotation of the hand", "deg", [_line("angle", log.times, turn)], settle_s
        ),
    ]


def joint_panels(log: ServoLog) -> list[Panel]:
    """Return the joints' angles, their commanded speeds, and the used share of the limits."""
    times, count = log.times, _hand_count(log)
    hand, eyes = log.names[:count], log.names[count:]
    angles = np.degrees(log.positions.reshape(len(log), len(log.names)))
    speeds = np.degrees(log.commands.reshape(len(log), len(log.names)))
    panels = [
        Panel("angles of the arm's joints", "deg", _lines(times, angles[:, :count], hand)),
        Panel("commanded speeds of the arm's joints", "deg/s", _lines(times, speeds, hand)),
    ]
    if eyes:
        lines = _lines(times, speeds[:, count:], eyes)
        panels.append(Panel("commanded speeds of the cameras' joints", "deg/s", lines))
    if log.joints is not None:
        shares = 100.0 * np.abs(speeds) / np.degrees(log.joints.speed)
        parts = [("arm", shares[:, :count]), ("cameras", shares[:, count:])]
        most = [
            _line(name, times, part.max(axis=1), place)
            for place, (name, part) in enumerate(parts)
            if part.size
        ]
        limit = Line("limit", times, np.full(len(times), 100.0), QUIET_INK, "--")
        panels.append(Panel("greatest share of a joint's speed limit in use", "%", (*most, limit)))
    return panels


def gaze_panels(log: ServoLog, settle_s: float) -> list[Panel]:
    """Return the target's distance from the image centres, and the angles of the cameras."""
    seen = log.seen
    times = np.array([time_s for time_s, _ in seen])
    eyes = max((len(one.off_px) for _, one in seen), default=0)
    off = np.full((len(seen), eyes), np.nan)
    for row, (_, one) in enumerate(seen):
        off[row, : len(one.off_px)] = np.linalg.norm(one.off_px, axis=1)
    names = ("left", "right") if eyes == 2 else [f"camera {one}" for one in range(eyes)]
    lines = _lines(times, off, names)
    panels = _with_zoom("fixation error: target to the image centre", "px", lines, settle_s)
    if log.eyes is not None:
        panels.append(_turned(log))
    return panels


def _moved(log: ServoLog) -> Panel:
    """Return the displacement of target and hand in the world, as in Figs. 10 and 11.

    The hand's displacement is from its goal at the start, so that both agree if it follows without
    an error.
    """
    places = np.full((len(log), 9), np.nan)
    for row, one in zip(places, log.rows, strict=True):
        row[6:] = one.world_from_hand.translation
        if one.truth is not None and one.world_from_goal is not None:
            row[:3] = one.truth.translation
            row[3:6] = one.world_from_goal.translation
    known = np.flatnonzero(np.isfinite(places[:, 0]))
    first = places[known[0]] if len(known) else np.full(9, np.nan)
    target = 1000.0 * (places[:, :3] - first[:3])
    hand = 1000.0 * (places[:, 6:] - first[3:6])
    axes = ("x", "y", "z")
    return Panel(
        "displacement in the world",
        "mm",
        (
            *_lines(log.times, target, [f"target {axis}" for axis in axes], _BAND),
            *_lines(log.times, hand, [f"hand {axis}" for axis in axes]),
        ),
    )


def _turned(log: ServoLog) -> Panel:
    """Return the actual and the desired angles of tilt and pans."""
    assert log.eyes is not None
    places = [log.eyes.tilt, log.eyes.pan_left, log.eyes.pan_right]
    names = ("tilt", "left pan", "right pan")
    wanted = np.full((len(log), 3), np.nan)
    for row, one in zip(wanted, log.rows, strict=True):
        if one.tick.command.gaze is not None:
            row[:] = one.tick.command.gaze
    angles = np.degrees(log.positions.reshape(len(log), len(log.names))[:, places])
    return Panel(
        "angles of the cameras' joints",
        "deg",
        (
            *_lines(log.times, np.degrees(wanted), [f"{name}, desired" for name in names], _BAND),
            *_lines(log.times, angles, names),
        ),
    )


def _with_zoom(title: str, unit: str, lines: Sequence[Line], settle_s: float) -> list[Panel]:
    """Return lines in a panel, and in an enlarged one if later values are much smaller."""
    whole = Panel(title, unit, tuple(lines))
    first = _greatest([line.values for line in lines])
    later = _greatest([line.values[line.times >= settle_s] for line in lines])
    if not later * _ZOOM < first or later == 0.0:
        return [whole]
    return [whole, Panel(f"{title}, enlarged", unit, whole.lines, _ROOM * later)]


def _greatest(values: Sequence[Floats]) -> float:
    """Return the greatest known magnitude, 0 if none is known."""
    known = [np.abs(one[np.isfinite(one)]) for one in values]
    return max((float(one.max()) for one in known if len(one)), default=0.0)


def _hand_count(log: ServoLog) -> int:
    return len(log.names) if log.joints is None else log.joints.hand_count


def _line(name: str, times: Floats, values: Floats, place: int = 0, style: str = "") -> Line:
    """Return a line whose colour and, without a style, whose dashes depend on its index."""
    dashes = style or _DASHES[place % len(_DASHES)]
    return Line(name, times, values, DISTINCT[place % len(DISTINCT)], dashes)


def _lines(
    times: Floats, values: Floats, names: Sequence[str], style: str = ""
) -> tuple[Line, ...]:
    """Return a line for each name, from the columns of values (T, N)."""
    return tuple(
        _line(name, times, values[:, place], place, style) for place, name in enumerate(names)
    )


def _draw(log: ServoLog, panels: list[Panel], counted_s: float) -> bytes:
    """Draw panels below each other, and return the PNG file's bytes.

    A line marks the time `counted_s` from which on errors count, if it is within the run.
    """
    figure = new_figure(_WIDE_IN, _PANEL_IN * len(panels) + 0.3)
    rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    spans = [(hold.start_s, hold.end_s) for hold in holds(log)]
    for axes in rows:
        for place, (start, end) in enumerate(spans):
            named = place == 0 and axes is rows[0]
            axes.axvspan(start, end, color=_SHADE, linewidth=0, label="held" if named else "")
    if len(log) > 1 and 0.0 < counted_s < float(log.times[-1]):
        for axes in rows:
            name = "counted from here" if axes is rows[0] else ""
            axes.axvline(counted_s, color=QUIET_INK, linestyle=":", linewidth=1.2, label=name)
    for axes, panel in zip(rows, panels, strict=True):
        _draw_panel(axes, panel)
    if len(log) > 1:
        rows[-1].set_xlim(float(log.times[0]), float(log.times[-1]))
    rows[-1].set_xlabel("time since servoing began, s", color=INK, fontsize=10)
    return png(figure)


def _draw_panel(axes: "Axes", panel: Panel) -> None:
    # Later lines are thinner, so that the lines below them still show.
    colors = list(dict.fromkeys(line.color for line in panel.lines))
    widths = dict(zip(colors, np.linspace(2.2, 1.2, len(colors) + 1)[1:], strict=True))
    for line in panel.lines:
        axes.plot(
            line.times,
            line.values,
            color=line.color,
            alpha=0.35 if line.style == _BAND else 1.0,
            linestyle=_PATTERNS[line.style],
            linewidth=5.5 if line.style == _BAND else widths[line.color],
            label=line.name,
        )
    if panel.reach is not None:
        signed = any(np.nanmin(line.values) < 0.0 for line in panel.lines if len(line.values))
        axes.set_ylim(-panel.reach if signed else 0.0, panel.reach)
    if not panel.has_values:
        axes.text(0.5, 0.5, "not known", transform=axes.transAxes, ha="center", color=QUIET_INK)
    axes.set_title(f"{panel.title} [{panel.unit}]", loc="left", color=INK, fontsize=10.5)
    if panel.lines:
        axes.legend(
            loc="upper left",
            bbox_to_anchor=(1.005, 1.03),
            frameon=False,
            fontsize=9,
            handlelength=1.6,
            labelspacing=0.25,
        )
    dress(axes)

"""The responses of several runs, with their medians and extremes, and their Bode diagrams."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from servoid.pose.exact import Floats
from servoid.view.axes import DISTINCT, new_figure, png
from servoid.view.page import INK
from servoid_experiments.bode.response import ResponseRow
from servoid_experiments.drawing import dress_across, legend_below
from servoid_experiments.stats import Spread, over

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AXES = {"sideways": "moved sideways", "depth": "moved in depth"}

_WIDE_IN, _HIGH_IN = 9.6, 6.4
_BLUE, _RED, _SKY, _ORANGE = DISTINCT[0], DISTINCT[1], DISTINCT[5], DISTINCT[4]
_STYLES = ((_BLUE, "-"), (_SKY, "--"), (_RED, "-"), (_ORANGE, "--"))
_FEWEST_DB, _MOST_DB = -12.0, 12.0
_TICKS_HZ = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
Band = tuple[Floats, Floats, Floats]
"""Median, lowest and highest value at each frequency, (L,) each."""

HALF_POWER = 2.0**-0.5


@dataclass(frozen=True, eq=False)
class Bode:
    """A signal's response along an axis in n runs, at frequencies `hz` (L,).

    Amplitude ratios and phases in degrees are (n, L); a negative phase is a lag.
    """

    hz: Floats
    gains: Floats
    phases_deg: Floats

    @classmethod
    def of(cls, rows: Sequence[ResponseRow], signal: str, axis: str) -> "Bode | None":
        """Collect the responses of runs, None if there are none."""
        answers = [answer for row in rows if (answer := row.answer(signal, axis)) is not None]
        if not answers:
            return None
        ratios = np.array([answer.ratio for answer in answers])
        # Slow motion is followed, so the phase starts near 0 and is never a full turn off.
        phases = np.degrees(np.unwrap(np.angle(ratios), axis=1))
        return cls(np.array(answers[0].hz), np.abs(ratios), phases)

    def phase_at(self, hz: float, sign: float = 1.0) -> Spread:
        """Return the phase in degrees at the nearest frequency; with a sign of -1 the lag."""
        return over((sign * self.phases_deg[:, self._nearest(hz)]).tolist())

    def missed_at(self, hz: float) -> Spread:
        """Return the share of the object's motion that is missed at the nearest frequency."""
        place = self._nearest(hz)
        turns = np.exp(1j * np.radians(self.phases_deg[:, place]))
        return over(np.abs(self.gains[:, place] * turns - 1.0).tolist())

    @property
    def bandwidth_hz(self) -> Spread:
        """Return where the amplitude first falls 3 dB below that of the object."""
        return self._leaving((HALF_POWER, np.inf))

    @property
    def faithful_hz(self) -> Spread:
        """Return up to which frequency the amplitude is within 3 dB of the object's."""
        return self._leaving((HALF_POWER, 1.0 / HALF_POWER))

    @property
    def peak(self) -> Spread:
        """Return the largest amplitude ratio."""
        return over(self.gains.max(axis=1).tolist())

    @property
    def bands(self) -> tuple[Band, Band]:
        """Return median and extremes over all runs, of the amplitude ratio and of the phase."""
        gains, phases = (
            (np.median(one, axis=0), one.min(axis=0), one.max(axis=0))
            for one in (self.gains, self.phases_deg)
        )
        return gains, phases

    @property
    def peak_hz(self) -> float:
        """Return the frequency at which the median is largest."""
        return float(self.hz[int(np.argmax(self.bands[0][0]))])

    @property
    def delay_s(self) -> Spread:
        """Return the delay that corresponds to the phases: the median over all frequencies."""
        return over(np.median(-self.phases_deg / (360.0 * self.hz), axis=1).tolist())

    def _nearest(self, hz: float) -> int:
        return int(np.argmin(np.abs(self.hz - hz)))

    def _leaving(self, bounds: tuple[float, float]) -> Spread:
        found = [leaving(self.hz, row, bounds) for row in self.gains]
        return over(np.inf if hz is None else hz for hz in found)


def leaving(hz: Floats, gains: Floats, bounds: tuple[float, float]) -> float | None:
    """Return where a gain (L,) first leaves its bounds, None if nowhere.

    Between two frequencies it is interpolated linearly in logarithms.
    """
    low, high = bounds
    outside = np.flatnonzero((gains < low) | (gains > high))
    if len(outside) == 0:
        return None
    after = int(outside[0])
    if after == 0:
        return float(hz[0])
    level = np.log(low if gains[after] < low else high)
    x, y = np.log(hz[after - 1 : after + 1]), np.log(gains[after - 1 : after + 1])
    return float(np.exp(x[0] + (x[1] - x[0]) * (level - y[0]) / (y[1] - y[0])))


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
        dress_across(axes)
    legend_below(figure, *panels[0, 0].get_legend_handles_labels(), columns=2)
    return png(figure)


def _draw(above: "Axes", below: "Axes", bode: Bode, look: tuple[str, str, str]) -> None:
    name, color, style = look
    gains, phases = bode.bands
    decibels = [20.0 * np.log10(part) for part in gains]
    for axes, (middle, low, high) in ((above, decibels), (below, phases)):
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

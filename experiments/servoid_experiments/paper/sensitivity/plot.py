"""A tornado plot: the change of a figure when each constant is changed alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from servoid.output import write_together
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid_experiments.report import Picture, csv_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 12  # constants drawn for a figure
_BAND = "#e4e0d8"


@dataclass(frozen=True)
class Effect:
    """The effect of a constant's other values: a name for each, and the figure with it.

    `greatest` is the largest change of the figure, and `clear` is whether it exceeds the
    differences between runs with other seeds.
    """

    constant: str
    was: str
    values: tuple[tuple[str, float], ...]
    greatest: float
    clear: bool

    @property
    def title(self) -> str:
        """Return the constant with its values."""
        others = " | ".join(name for name, _ in self.values)
        return f"{self.constant.replace('_', ' ')}: {self.was}\n({others})"


def draw_tornado(
    effects: Mapping[str, Sequence[Effect]],
    middles: Mapping[str, tuple[float, float]],
    file: Path,
    caption: str,
) -> Picture:
    """Draw a panel for each figure, the first effects at the top, and write all of them as CSV.

    `middles` are the figures with the assumed constants, and the random deviation of single runs.

    Raises:
        OutputError: a file cannot be written.

    """
    shown = {name: all_of[:_MOST] for name, all_of in effects.items()}
    heights = [len(few) for few in shown.values()]
    figure = new_figure(9.6, 0.36 * sum(heights) + 0.9 * len(heights))
    panels = figure.subplots(len(shown), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (name, few) in zip(panels, shown.items(), strict=True):
        _draw_effects(axes, few, *middles[name])
        axes.set_title(name, loc="left", color=INK, fontsize=11)
    _explain(figure)
    rows = [
        (name, one.title, value, figure_value, middles[name][0], middles[name][1])
        for name, all_of in effects.items()
        for one in all_of
        for value, figure_value in one.values
    ]
    head = ("figure", "constant", "value", "with it", "as assumed", "by chance")
    write_together({file: png(figure), file.with_suffix(".csv"): csv_of(head, rows)})
    return Picture(file, caption)


def _draw_effects(axes: "Axes", few: Sequence[Effect], middle: float, band: float) -> None:
    """Draw a row of bars from the centre for each constant."""
    axes.axvspan(middle - band, middle + band, color=_BAND, linewidth=0)
    for row, one in enumerate(few):
        # If both bars point to one side, both must be visible.
        height = 0.8 / len(one.values)
        for place, (_, value) in enumerate(one.values):
            axes.barh(
                row - 0.4 + (place + 0.5) * height,
                value - middle,
                height,
                left=middle,
                color=DISTINCT[place % len(DISTINCT)],
            )
    axes.axvline(middle, color=QUIET_INK, linewidth=0.9)
    axes.set_yticks(range(len(few)), [one.title for one in few])
    axes.invert_yaxis()
    dress(axes)
    axes.grid(visible=False, axis="y")
    axes.grid(axis="x", color="#e6e6e6", linewidth=0.8)
    axes.tick_params(axis="y", labelsize=8)


def _explain(figure: "Figure") -> None:
    """Add a legend below a figure with the colour of each value."""
    from matplotlib.patches import Patch

    labels = ("first value in brackets", "second", "third")
    figure.legend(
        handles=[
            Patch(color=color, label=label) for color, label in zip(DISTINCT, labels, strict=False)
        ],
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize=10,
    )

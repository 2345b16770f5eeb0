"""The style of the studies' plots, beside that of `servoid.view.axes`."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from servoid.view.axes import dress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def dress_across(axes: "Axes") -> None:
    """Style axes with a grid along the horizontal axis, too."""
    dress(axes)
    axes.grid(axis="x", color="#e6e6e6", linewidth=0.8)


def legend_below(
    figure: "Figure", handles: Sequence[Any], names: Sequence[str], columns: int
) -> None:
    """Add a legend below a figure."""
    figure.legend(
        handles, names, loc="outside lower center", ncols=columns, frameon=False, fontsize=10
    )

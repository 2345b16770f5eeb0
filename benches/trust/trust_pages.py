"""Writes the tables and the figure on trust for the documentation.

Used by the scripts beside it.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from servoid.output import write_together
from servoid.view.axes import DISTINCT, dress, new_figure, png
from servoid.view.page import QUIET_INK
from trust_table import BINS, REGION, Row, joined

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOCS = Path(__file__).resolve().parents[2] / "docs"
BY_SEQUENCE, BY_VARIANT = (
    DOCS / "tables" / f"trust-{name}.tsv" for name in ("sequences", "variants")
)
PICTURE = DOCS / "images" / "trust.png"
LEAST = 20  # least number of images for a step of the confidence to be drawn
TITLES = ("images", "tracked", "right", "wrong, median", "wrong, worst", "in a row")
FURTHER = ("lost", "found", "after", "ADD mm", "position", "rotation", "both")
PARTS = ("position", "rotation", "both")
NOTHING = "–"  # a hyphen would be a list of Markdown


def write_pages(rows: Sequence[Row]) -> None:
    """Write the tables and the figure.

    Raises:
        OutputError: one cannot be written; then none changes.

    """
    by_sequence = grouped(rows, lambda row: row.sequence)
    files = {
        BY_SEQUENCE: table("sequence", by_sequence).encode(),
        BY_VARIANT: table("variant", grouped(rows, lambda row: row.variant)).encode(),
        PICTURE: picture(joined(("all", ""), rows), by_sequence),
    }
    for path in files:
        path.parent.mkdir(exist_ok=True)
    write_together(files)


def grouped(rows: Sequence[Row], name_of: Callable[[Row], str]) -> dict[str, Row]:
    """Combine rows with the same name."""
    names = dict.fromkeys(map(name_of, rows))
    return {
        name: joined((name, ""), (row for row in rows if name_of(row) == name)) for name in names
    }


def table(title: str, rows: dict[str, Row]) -> str:
    """Format rows for a page: shares in per cent, medians and worst over the runs."""
    lines: list[tuple[str, ...]] = [(title, *TITLES, *FURTHER)]
    for name, row in rows.items():
        shares = (row.tracked_percent, row.right_percent)
        shares = (*shares, float(np.median(row.wrong_percent)), max(row.wrong_percent))
        after = f"{np.median(row.found):.0f}" if row.found else NOTHING
        lines.append(
            (
                *(name, str(sum(row.images)), *(f"{one:.1f}" for one in shares)),
                *(str(max(row.longest)), str(len(row.found_after)), str(len(row.found)), after),
                *(shown(row.add_mm, 1), *(shown(one, 0) for one in row.covered_percent)),
            )
        )
    return "".join("\t".join(line) + "\n" for line in lines)


def shown(number: float, digits: int) -> str:
    """Format a number, or a dash if there is none."""
    return NOTHING if np.isnan(number) else f"{number:.{digits}f}"


def picture(whole: Row, rows: dict[str, Row]) -> bytes:
    """Draw how often poses are right by their confidence, and the coverage of the covariances."""
    figure = new_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.4))
    _reliability(left, whole)
    _coverage(right, rows)
    return png(figure)


def _reliability(axes: "Axes", whole: Row) -> None:
    dress(axes)
    middles = (np.arange(BINS) + 0.5) / BINS
    curves = (
        ("tracking or searching", whole.told, whole.told_right),
        ("tracking", whole.tracking, whole.tracking_right),
    )
    for color, (name, counts, rights) in zip(DISTINCT, curves, strict=False):
        count = np.array(counts)
        enough = count >= LEAST
        share = np.array(rights)[enough] / count[enough]
        axes.plot(middles[enough], share, "o-", color=color, label=name)
    axes.plot((0.0, 1.0), (0.0, 1.0), ":", color="#888888", linewidth=1.0)
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.03), xlabel="confidence")
    axes.set_ylabel("poses that are right [share]")
    axes.legend(frameon=False, loc="lower right")


def _coverage(axes: "Axes", rows: dict[str, Row]) -> None:
    dress(axes)
    heights = np.arange(len(rows))[::-1]
    for place, (name, color) in enumerate(zip(PARTS, DISTINCT, strict=False)):
        covered = [row.covered_percent[place] for row in rows.values()]
        axes.plot(covered, heights + 0.2 * (1 - place), "o", color=color, label=name)
    axes.axvline(100.0 * REGION, color="#888888", linestyle=":", linewidth=1.0)
    axes.set_yticks(heights, labels=list(rows))
    for height, row in zip(heights, rows.values(), strict=True):
        if np.isnan(row.covered_percent).all():
            axes.text(2.0, height, "not tracked", va="center", color=QUIET_INK, fontsize=9)
    axes.set(xlim=(0.0, 102.0), xlabel="true poses in the region of 95 % [%]")
    axes.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))

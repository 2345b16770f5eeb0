"""The report of a study: verdicts, figures and tables, which are its data."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

Cell = str | float | int | None


class Verdict(Enum):
    """How a result relates to the paper's claim."""

    AGREES = "agrees"
    PARTLY = "agrees in part"
    DIFFERS = "differs"
    BEYOND = "goes beyond"


@dataclass(frozen=True)
class Finding:
    """A claim of the paper, and whether the results agree with it."""

    claim: str
    verdict: Verdict


@dataclass(frozen=True)
class Table:
    """Rows of cells below headings; `name` is that of its CSV file, without the suffix.

    None is an unknown cell, and inf one beyond all that was tried.
    """

    name: str
    caption: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]

    def csv(self) -> bytes:
        """Return the table as the bytes of a CSV file."""
        return csv_of(self.headings, self.rows)


@dataclass(frozen=True)
class Picture:
    """A PNG file with a caption that describes what it shows and how to read it."""

    file: Path
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of a study's page: findings, figures and tables, in that order."""

    heading: str
    findings: tuple[Finding, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()


def csv_of(headings: Sequence[str], rows: Iterable[Sequence[Cell]]) -> bytes:
    """Return rows below headings as the bytes of a CSV file, numbers with six digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(headings)
    writer.writerows([_written(cell, 6) for cell in row] for row in rows)
    return text.getvalue().encode()


def shown(cell: Cell) -> str:
    """Format a cell for a page."""
    return "-" if cell is None else _written(cell, 4)


def _written(cell: Cell, digits: int) -> str:
    if cell is None:
        return ""
    return f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell)

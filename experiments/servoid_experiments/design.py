"""The definition of a study: settings, the trials that they require, and what it reports.

A report is data: verdicts, pictures and tables.
"""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Any, Generic, TypeVar

import msgspec
from msgspec import Meta

from servoid.batch import Experiment, Results, Work

SettingsT = TypeVar("SettingsT", bound=msgspec.Struct)
RowT = TypeVar("RowT", bound=msgspec.Struct)

Count = Annotated[int, Meta(ge=1)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Positive = Annotated[float, Meta(gt=0.0)]

Cell = str | float | int | None


def about(description: str, **bounds: Any) -> Meta:
    """Describe a setting, or a column of results, and give its bounds, as in `msgspec.Meta`."""
    return Meta(description=description, **bounds)


class Verdict(Enum):
    """How a result relates to the paper's claim."""

    AGREES = "agrees"
    PARTLY = "agrees in part"
    DIFFERS = "differs"
    BEYOND = "goes beyond"


@dataclass(frozen=True)
class Table:
    """Rows of cells below headings; `name` is that of its CSV file, without the suffix.

    None is an unknown cell, and inf one beyond all that was tried. Without a caption, a table is
    not on the page.
    """

    name: str
    headings: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""

    def csv(self) -> bytes:
        """Return the table as the bytes of a CSV file, numbers with six digits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.headings)
        writer.writerows([_written(cell, 6) for cell in row] for row in self.rows)
        return text.getvalue().encode()


@dataclass(frozen=True)
class Picture:
    """A PNG file, a caption that describes what it shows, and the numbers in it.

    `name` is that of the file, without the suffix.
    """

    name: str
    caption: str
    png: bytes
    numbers: Table | None = None


@dataclass(frozen=True)
class Section:
    """A part of a study's page: pictures and tables, and which claims of the paper they confirm."""

    heading: str
    findings: Mapping[str, Verdict] = field(default_factory=dict)
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()


@dataclass(frozen=True)
class Study(Generic[SettingsT]):
    """A question that is answered by trials.

    `settings` is a frozen msgspec struct whose defaults are the whole study; `quick` are settings
    of a small one that takes seconds. `plan` returns the trials for settings. `report` returns the
    sections of the study's page, whose pictures and tables are its data; it omits failed trials,
    which have no row.
    """

    name: str
    title: str
    question: str
    settings: type[SettingsT]
    quick: SettingsT
    plan: Callable[[SettingsT], Sequence[Work]]
    report: Callable[[SettingsT, Results], Sequence[Section]]


def rows_of(results: Results, experiment: Experiment[Any, RowT], **fields: Any) -> list[RowT]:
    """Return the rows of an experiment's successful trials whose cases have such fields."""
    return [
        one.row
        for one in results.get(experiment.name, ())
        if one.row is not None
        and all(getattr(one.case, name) == value for name, value in fields.items())
    ]


def shown(cell: Cell) -> str:
    """Format a cell for a page."""
    return "-" if cell is None else _written(cell, 4)


def _written(cell: Cell, digits: int) -> str:
    if cell is None:
        return ""
    return f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell)

"""What a study found, ready to be put on a page."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path


class Verdict(Enum):
    """How our figure stands to what a paper says."""

    AGREES = "agrees"
    PARTLY = "agrees in part"
    DIFFERS = "differs"
    BEYOND = "goes beyond"


@dataclass(frozen=True)
class Finding:
    """What was found before, in our words, what we measured, and how the two compare and why."""

    before: str
    ours: str
    verdict: Verdict
    why: str


@dataclass(frozen=True)
class Table:
    """Rows of cells below headings, all of them texts."""

    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    caption: str = ""


@dataclass(frozen=True)
class Picture:
    """A PNG file with a caption that says what it shows and how to read it."""

    file: Path
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of a study's page: sentences, then findings, pictures and tables, in that order."""

    heading: str
    words: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()

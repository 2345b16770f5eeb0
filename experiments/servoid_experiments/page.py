"""The page of a study: one file that needs nothing beside it."""

import base64
import html
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from servoid.errors import OutputError
from servoid.output import write_whole
from servoid_experiments.findings import Finding, Picture, Section, Table

_NAME = "index.html"
_NUMBER = re.compile(r"[-+−±<>≤≥ ]*\d[\d.,\s]*(%|°)?")


def write_study_page(
    folder: str | Path,
    title: str,
    sections: Sequence[Section],
    *,
    asks: str = "",
    settings: str = "",
    notes: Sequence[str] = (),
) -> Path:
    """Write `index.html` into a folder that exists, and return its path.

    `asks` is the study's question, `settings` its TOML text, and `notes` are sentences that the
    page shows above all else.

    Raises:
        OutputError: the page cannot be written, or a picture cannot be read.

    """
    parts = {
        "title": html.escape(title),
        "asks": html.escape(asks),
        "notes": _notes(notes),
        "contents": "\n".join(_contents(*one) for one in enumerate(sections, 1)),
        "sections": "\n".join(_section(*one) for one in enumerate(sections, 1)),
        "settings": html.escape(settings),
    }
    template = files("servoid_experiments").joinpath("page.html").read_text(encoding="utf-8")
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match.group(1)], template)
    path = Path(folder) / _NAME
    write_whole(path, page.encode())
    return path


def _notes(notes: Sequence[str]) -> str:
    items = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return f'<ul class="notes">{items}</ul>' if items else ""


def _contents(number: int, section: Section) -> str:
    """Return a line that leads to a section, and the verdicts on its findings below it."""
    verdicts = "".join(
        f'<li><span class="{one.verdict.name.lower()}">{html.escape(one.verdict.value)}:</span> '
        f"{html.escape(one.before)}</li>"
        for one in section.findings
    )
    inner = f"<ul>{verdicts}</ul>" if verdicts else ""
    return f'<li><a href="#s{number}">{html.escape(section.heading)}</a>{inner}</li>'


def _section(number: int, section: Section) -> str:
    parts = [f'<h2 id="s{number}">{html.escape(section.heading)}</h2>']
    parts += [f"<p>{html.escape(words)}</p>" for words in section.words]
    parts += [_findings(section.findings)] if section.findings else []
    parts += map(_picture, section.pictures)
    parts += map(_table, section.tables)
    return "\n".join(parts)


def _findings(findings: Sequence[Finding]) -> str:
    rows = "\n".join(
        f"<tr>{_cell(one.before)}{_cell(one.ours)}"
        f'<td class="verdict {one.verdict.name.lower()}">{html.escape(one.verdict.value)}</td>'
        f"{_cell(one.why)}</tr>"
        for one in findings
    )
    heads = "".join(f"<th>{head}</th>" for head in ("before", "here", "verdict", "why"))
    return (
        f'<div class="scroll"><table class="findings">\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _picture(picture: Picture) -> str:
    try:
        data = base64.b64encode(picture.file.read_bytes()).decode()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"cannot put {picture.file} into the page: {reason}") from error
    caption = html.escape(picture.caption)
    return (
        f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">\n'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def _table(table: Table) -> str:
    caption = f"<caption>{html.escape(table.caption)}</caption>" if table.caption else ""
    columns = zip(*table.rows, strict=True) if table.rows else ((),) * len(table.headings)
    marks = [_mark(column) for column in columns]
    heads = "".join(
        f"<th{mark}>{html.escape(head)}</th>"
        for head, mark in zip(table.headings, marks, strict=True)
    )
    rows = "\n".join(f"<tr>{''.join(map(_cell, row, marks))}</tr>" for row in table.rows)
    return (
        f'<div class="scroll"><table>{caption}\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _mark(column: Sequence[str]) -> str:
    """Return what makes a column of numbers stand under each other."""
    numbers = [bool(_NUMBER.fullmatch(text)) for text in column if text]
    return ' class="number"' if numbers and all(numbers) else ""


def _cell(text: str, mark: str = "") -> str:
    return f"<td{mark}>{html.escape(text)}</td>"

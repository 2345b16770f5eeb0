"""Writes the page of a study: one self-contained file."""

import html
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path

from servoid.output import write_whole
from servoid.view.page_parts import fill_text, image, notes_list, scrolling, wide
from servoid_experiments.design import Picture, Section, Table, shown

# The caption below describes the figure; the text for screen readers does not repeat it.
_SHOWN = "A picture of what the caption says; its numbers are in the tables of this section"


def write_study_page(
    folder: str | Path,
    title: str,
    sections: Sequence[Section],
    *,
    question: str = "",
    settings: str = "",
    notes: Sequence[str] = (),
) -> Path:
    """Write `index.html` into a folder that exists, and return its path.

    `question` is the study's question, `settings` its TOML text, and `notes` are sentences that the
    page shows at the top.

    Raises:
        OutputError: the page cannot be written.

    """
    parts = {
        "title": html.escape(title),
        "question": html.escape(question),
        "notes": notes_list(notes),
        "contents": "\n".join(_contents(*one) for one in enumerate(sections, 1)),
        "sections": "\n".join(_section(*one) for one in enumerate(sections, 1)),
        "settings": html.escape(settings),
    }
    template = files("servoid_experiments").joinpath("page.html").read_text(encoding="utf-8")
    path = Path(folder) / "index.html"
    write_whole(path, fill_text(template, parts))
    return path


def _contents(number: int, section: Section) -> str:
    """Return an entry that links to a section, with its verdicts below."""
    verdicts = "".join(
        f'<li><span class="{verdict.name.lower()}">{html.escape(verdict.value)}:</span> '
        f"{html.escape(claim)}</li>"
        for claim, verdict in section.findings.items()
    )
    inner = f"<ul>{verdicts}</ul>" if verdicts else ""
    return f'<li><a href="#s{number}">{html.escape(section.heading)}</a>{inner}</li>'


def _section(number: int, section: Section) -> str:
    parts = [f'<h2 id="s{number}">{html.escape(section.heading)}</h2>']
    parts += map(_picture, section.pictures)
    parts += [_table(one) for one in section.tables if one.caption]
    return "\n".join(parts)


def _picture(picture: Picture) -> str:
    element = wide(image(picture.png, _SHOWN), picture.caption)
    caption = f"<figcaption>{html.escape(picture.caption)}</figcaption>"
    return f"<figure>{element}\n{caption}</figure>"


def _table(table: Table) -> str:
    columns = zip(*table.rows, strict=True) if table.rows else ((),) * len(table.headings)
    numeric = [any(isinstance(one, float | int) for one in column) for column in columns]
    marks = [' class="number"' if one else "" for one in numeric]
    heads = _cells("th", table.headings, [f' scope="col"{mark}' for mark in marks])
    body = "\n".join(f"<tr>{_cells('td', map(shown, row), marks)}</tr>" for row in table.rows)
    element = (
        f"<table><caption>{html.escape(table.caption)}</caption>\n"
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}\n</tbody></table>"
    )
    return scrolling(element, table.caption)


def _cells(tag: str, texts: Iterable[str], marks: Sequence[str]) -> str:
    pairs = zip(texts, marks, strict=True)
    return "".join(f"<{tag}{mark}>{html.escape(text)}</{tag}>" for text, mark in pairs)

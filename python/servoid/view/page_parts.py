"""The parts shared by all report pages: templates, notes, pictures, and their folder."""

import base64
import html
import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from importlib.resources import files
from itertools import zip_longest
from pathlib import Path
from typing import Any

from servoid._native import __version__
from servoid.errors import OutputError
from servoid.words import reason_of

_CELL = re.compile(r"<t[hd][^>]*>(.*?)</t[hd]>", re.DOTALL)
_TAG = re.compile(r"<[^>]*>")
_NARROW = 40  # characters of a row that fit on a phone
_OPTION = re.compile(r"(?<!\S)--[a-z][a-z-]*")


def fill(template: str, parts: Mapping[str, str]) -> bytes:
    """Return a page: a template beside this file, with each {{name}} replaced by a part."""
    return fill_text(read(template), parts)


def fill_text(text: str, parts: Mapping[str, str]) -> bytes:
    """Return the page of a template in another folder, as `fill` does."""
    text = _with_head(text)
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match.group(1)], text)
    return page.encode(errors="replace")  # names of files need not be UTF-8


def _with_head(text: str) -> str:
    """Return a template with the common head, which allows scripts if the template has one."""
    scripts = "; script-src 'unsafe-inline'" if "<script>" in text else ""
    return text.replace("{{head}}\n", read("head.html").replace("{{scripts}}", scripts))


def read(name: str) -> str:
    """Return the text of a file beside this one."""
    return files("servoid.view").joinpath(name).read_text(encoding="utf-8")


def json_text(data: Any) -> str:
    """Return JSON that contains no `</script>`."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def paragraphs(lines: Sequence[str]) -> str:
    """Return each line as a paragraph."""
    return "\n".join(f"<p>{html.escape(line)}</p>" for line in lines)


def origin(source: str) -> str:
    """Return a line below the title: what the page is of, and the version that made it."""
    words = f"{source} · servoid {__version__}" if source else f"servoid {__version__}"
    return f'<p class="quiet">{html.escape(words)}</p>'


def verdict_list(sentences: Sequence[str]) -> str:
    """Return the verdict of a page, as emphasised paragraphs."""
    shown = [_with_options(html.escape(one)) for one in sentences]
    return "\n".join(f'<p class="verdict">{one}</p>' for one in shown)


def notes_list(notes: Sequence[str]) -> str:
    """Return the notes at the top of a page, as a list; empty without notes."""
    items = "".join(f"<li>{_with_options(html.escape(note))}</li>" for note in notes)
    return f'<ul class="notes">{items}</ul>' if items else ""


def _with_options(text: str) -> str:
    """Return text in which browsers do not break options at their hyphens."""
    return _OPTION.sub(r'<span class="option">\g<0></span>', text)


def image(data: bytes, words: str, kind: str = "png") -> str:
    """Return a picture as an element that contains it; `words` describe it."""
    encoded = base64.b64encode(data).decode()
    return f'<img alt="{html.escape(words)}" src="data:image/{kind};base64,{encoded}">'


def picture(data: bytes, caption: str, shown: str = "") -> str:
    """Return a PNG picture below its heading; `shown` describes it for screen readers."""
    return f"<h2>{html.escape(caption)}</h2>\n{wide(image(data, shown or caption), caption)}"


def wide(element: str, name: str) -> str:
    """Return a picture that keeps a readable size on small screens, where it scrolls."""
    return _region("wide", element, name)


def scrolling(element: str, name: str) -> str:
    """Return a table that scrolls if it is wider than the page; its edge is shaded then.

    If it is wider than a phone, the page says so there, as of a picture.
    """
    return _region("scroll long" if _width(element) > _NARROW else "scroll", element, name)


def _width(table: str) -> int:
    """Return the characters of the longest cells of all columns of a table."""
    rows = [
        [len(html.unescape(_TAG.sub("", cell))) for cell in _CELL.findall(row)]
        for row in table.split("</tr>")
    ]
    return sum(max(column) for column in zip_longest(*rows, fillvalue=0))


def _region(kind: str, element: str, name: str) -> str:
    label = html.escape(name)
    return f'<div class="{kind}" role="region" tabindex="0" aria-label="{label}">{element}</div>'


def write_report_files(directory: Path, contents: Mapping[str, bytes]) -> list[Path]:
    """Write the files of a report, by their names, into a folder; return their paths.

    The folder is created if it is missing; other files in it stay unchanged.

    Raises:
        OutputError: the folder cannot be written; then no file of the report in it changes.

    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".servoid-", dir=directory) as drafts:
            for name, data in contents.items():
                (Path(drafts) / name).write_bytes(data)
            for name in contents:
                if (directory / name).is_dir():
                    raise OutputError(f"cannot write {directory / name}: it is a folder")
            for name in contents:
                (Path(drafts) / name).replace(directory / name)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(f"cannot write a report into {directory}: {reason_of(error)}") from error
    return [directory / name for name in contents]

"""Writes the report of a track: a page, pictures and figures."""

import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from servoid.track import History, Subject, TrackResult
from servoid.view.page_parts import (
    fill,
    json_text,
    notes_list,
    origin,
    paragraphs,
    picture,
    read,
    scrolling,
    verdict_list,
    write_report_files,
)
from servoid.view.track.growth_picture import FRONT, RIGHT, UP, draw_growth, solids_of
from servoid.view.track.sides_map import draw_sides
from servoid.view.track.timeline_plot import draw_timeline
from servoid.view.track.track_figures import TrackFigures
from servoid.view.track.turning_plot import draw_turning
from servoid.view.turntable import turntable_scene

_MOST_ROWS = 40  # of a table
_MS_PER_S = 1e3

_CAPTIONS = {
    "growth.png": (
        "How the body grew",
        "On the left, a camera's image; in the pictures of the body beside it, the orange line is "
        "its previous outline. Sides have their names from the first image of the first camera.",
    ),
    "sides.png": (
        "From which sides it was seen",
        "An equal-area map of all viewing directions in the object's frame. The dots are "
        "the cameras while the pose was tracked.",
    ),
    "turning.png": (
        "How far the rotation may have drifted",
        "The drift of the rotation since the first image; it falls where a known side is seen "
        "again. Marks are corrections, plotted at the drift before them.",
    ),
    "timeline.png": (
        "The result of each observation",
        "A lane for each status; searching, located means that the position is confirmed and the "
        "rotation is not. A pose counts as right if it is off by at most 20 mm, or a tenth of the "
        "object's diameter if that is more, and 15 degrees; trust it only while the status is "
        "tracking. Triangles mark the steps after which the body was another.",
    ),
}
_SHOWN = {
    "growth.png": "Images of a camera beside the body after each change, with its outline",
    "sides.png": "A map of all directions around the object with the cameras as dots",
    "turning.png": "Lines of drift against the total rotation of the object",
    "timeline.png": "Over time: status, confidence, notices, and milliseconds per step",
}

Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]


def write_track_report(
    result: TrackResult,
    history: History,
    directory: str | Path,
    *,
    notes: Sequence[str] = (),
    source: str = "",
    ending: str | None = None,
) -> list[Path]:
    """Write the pictures and the figures of a track into a folder; return the files' paths.

    They are `report.html` (everything on one page, with an interactive view of the body),
    `growth.png` (the body after each change), `sides.png` (the sides that were seen),
    `turning.png` (drift against the total rotation), `timeline.png` (status, confidence, notices,
    times) and `summary.json`. The page begins with `source`, what was tracked, `ending`, why the
    track is not finished, and the sentences `notes`. The folder is created if it is missing; other
    files in it stay unchanged.

    Raises:
        OutputError: the folder cannot be written; then no file of the report in it changes.

    """
    figures = TrackFigures(result, history)
    pictures = {
        "growth.png": draw_growth(history, figures.sides.sides_from_object),
        "sides.png": draw_sides(figures.sides, history.names),
        "turning.png": draw_turning(figures.turning, figures.is_tracked),
        "timeline.png": draw_timeline(result.tracked, result.notices_on_all),
    }
    unfinished = [f"The tracking was not finished: {ending}."] if ending else []
    verdict = [*unfinished, *figures.verdict()]
    notes = [*notes, *(f"At the start: {one}" for one in result.notes if one not in result.doubts)]
    summary = json.dumps(figures.summary(), indent=1, allow_nan=False, ensure_ascii=False)
    files = {
        "report.html": _page(figures, pictures, verdict, notes, source),
        **pictures,
        "summary.json": (summary + "\n").encode(),
    }
    return write_report_files(Path(directory), files)


def _page(
    figures: TrackFigures,
    pictures: Mapping[str, bytes],
    verdict: Sequence[str],
    notes: Sequence[str],
    source: str,
) -> bytes:
    result = figures.result
    solids = solids_of(result.body, figures.history.surface, figures.sides.sides_from_object)
    return fill(
        "track_report.html",
        {
            "title": html.escape(_title(result.name)),
            "origin": origin(source),
            "verdict": verdict_list(verdict),
            "words": paragraphs(list(figures.words())),
            "notes": notes_list(notes),
            "pictures": "\n".join(_picture(name, data) for name, data in pictures.items()),
            "tables": "\n".join(_table(*one) for one in _tables(figures) if one[2]),
            "scene": json_text(turntable_scene(solids, (FRONT, RIGHT, UP))),
            "script": read("turntable.js"),
        },
    )


def _title(name: str) -> str:
    return "The track of the object" if name == Subject.name else f"The track of {name}"


def _picture(name: str, data: bytes) -> str:
    caption, words = _CAPTIONS[name]
    shown = picture(data, caption, _SHOWN[name])
    return f'{shown}\n<p class="quiet">{html.escape(words)}</p>' if words else shown


def _tables(figures: TrackFigures) -> list[Table]:
    """Return each table: its title, the names of its columns, and its rows."""
    result = figures.result
    return [
        (
            "Sides",
            ("side", "first seen"),
            [
                (name, "never" if when is None else f"{when:.2f} s")
                for name, when in figures.sides_seen.items()
            ],
        ),
        (
            "Corrections of the rotation",
            ("at", "why", "by"),
            [
                (f"{one.time_s:.2f} s", one.cause.value, f"{np.degrees(one.angle):.1f}°")
                for one in figures.turning.corrections
            ],
        ),
        (
            "Not tracked",
            ("from", "to", "observations"),
            [
                (f"{gap.first_s:.2f} s", f"{gap.last_s:.2f} s", str(gap.count))
                for gap in result.gaps
            ],
        ),
        (
            "Time of a step, on average",
            ("stage", "time"),
            [
                (stage, f"{_MS_PER_S * seconds:.2f} ms")
                for stage, seconds in result.stage_seconds.items()
            ],
        ),
        (
            "Notices",
            ("notice", "times"),
            [
                *((words, str(len(result))) for words in result.notices_on_all),
                *((words, str(count)) for words, count in result.notices),
            ],
        ),
    ]


def _table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in columns)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
        for row in rows[:_MOST_ROWS]
    )
    more = len(rows) - _MOST_ROWS
    rest = f'<p class="quiet">And {more} more.</p>' if more > 0 else ""
    table = f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>"
    return f"<div>\n<h3>{html.escape(title)}</h3>\n{scrolling(table, title)}\n{rest}</div>"

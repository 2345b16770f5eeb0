"""Writes the report of a servo run as one self-contained page."""

import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError
from servoid.output import write_whole
from servoid.servo import (
    GoalTimes,
    Hold,
    LimitingKind,
    ServoLog,
    ServoMetrics,
    holds,
    verdict_of,
    why_errors_unknown,
)
from servoid.view.page_parts import (
    fill,
    image,
    notes_list,
    origin,
    picture,
    scrolling,
    verdict_list,
)
from servoid.words import reason_of

_NAME = "report.html"
_QUALITY = 90  # of the JPEG picture of the overview
_MOST_HOLDS = 40
_VALUE = re.compile(r"\d[\d.]* (?:mm/s|mm|deg|ms|px|s|%)(?!\w)")  # which no line break divides

_SHOWN = {
    "hand.png": "Plots over time: displacement of target and hand, and the hand's errors",
    "joints.png": "Plots over time: angles and commanded speeds of the joints",
    "gaze.png": "Plots over time: fixation error in pixels and the angles of the cameras' joints",
    "contact_sheet.png": "Images of the looks with the outline of each ellipsoid drawn over them",
    "body.png": "The body drawn from four sides and, beside it, the camera poses",
    "curve.png": "Lines over the count of ellipsoids: fitness, IoU of the views",
}

_CAPTIONS = {
    "hand.png": "Errors of the hand",
    "joints.png": "Joints",
    "gaze.png": "Gaze of the cameras",
    "contact_sheet.png": "The modelled views, with the ellipsoids' outlines",
    "body.png": "The body from four sides, and the cameras",
    "curve.png": "Fitness and silhouette IoU against the count of ellipsoids",
}
_WORDS = {
    "hand.png": "Repeatability is relative to the body where it was modelled, accuracy to the true "
    "object; x, y and z are those of the goal's frame.",
    "joints.png": "Speeds are those that were commanded.",
    "gaze.png": "The fixation error is measured with the true object; desired angles are pale.",
    "contact_sheet.png": "IoU is the intersection over union of mask and silhouette.",
}


@dataclass(frozen=True, eq=False)
class ServoPictures:
    """The pictures of a report.

    `overview` is an image (H, W, 3) uint8 RGB of the arm during the run; `files` are PNG pictures,
    shown in this order, with a heading that depends on the file's name.
    """

    overview: NDArray[np.uint8] | None = None
    files: Sequence[Path] = ()


def write_servo_report(
    folder: str | Path,
    log: ServoLog,
    summary: Mapping[str, str],
    pictures: ServoPictures,
    *,
    title: str = "A run of visual servoing",
    source: str = "",
    settings: str = "",
    settle_s: float = 0.0,
    notes: Sequence[str] = (),
    ending: str | None = None,
) -> Path:
    """Write `report.html` into a folder that exists, and return its path.

    `summary` contains the key figures by name, and `settings` is the TOML text of the settings. The
    page begins with `source`, what was servoed to, whether the run is good, the errors after
    `settle_s` seconds of servoing, and the sentences `notes`; `ending` says why the run is not
    finished.

    Raises:
        OutputError: the page cannot be written, or a picture cannot be read.

    """
    shaded = "; the plots shade these times" if pictures.files else ""
    times = GoalTimes.of(log, settle_s)
    parts = {
        "title": html.escape(title),
        "origin": origin(source),
        "verdict": verdict_list([_unbroken(one) for one in _verdict(log, times, settle_s, ending)]),
        "notes": notes_list(notes),
        "overview": "" if pictures.overview is None else _overview(pictures.overview),
        "figures": "\n".join(_figure(*one) for one in {**summary, **_limited(times)}.items()),
        "pictures": "\n".join(_picture(Path(path)) for path in pictures.files),
        "holds": _held(log, shaded),
        "settings": _settings(settings),
    }
    path = Path(folder) / _NAME
    write_whole(path, fill("servo_report.html", parts))
    return path


def _verdict(log: ServoLog, times: GoalTimes, settle_s: float, ending: str | None) -> list[str]:
    """Return sentences: whether the run is good, the errors of the hand, and its main limit."""
    metrics = ServoMetrics.of(log, settle_s)
    rating = f"Servoing: {verdict_of(log, metrics, ending).words}."
    if why_errors_unknown(log, settle_s) is not None:
        return [rating]
    true = metrics.accuracy
    held = "" if metrics.holds else " The hand was never held."  # else the rating has it
    sentences = [
        rating,
        f"Repeatability {_errors(metrics.position_rms, metrics.position_95)}; "
        f"accuracy {_errors(true.position_rms, true.position_95)}; "
        f"both after {settle_s:g} s of servoing.{held}",
    ]
    limit = times.main_limit()
    if limit is not None:
        reason, seconds = limit
        sentences.append(f"Mostly limited by: {reason.value}, for {times.in_words(seconds)}.")
    return sentences


def _unbroken(text: str) -> str:
    """Return text in which no line break divides a number from its unit."""
    return _VALUE.sub(lambda match: match[0].replace(" ", "\N{NO-BREAK SPACE}"), text)


def _errors(rms: float, most: float) -> str:
    """Describe errors of the hand's position."""
    return "not known" if np.isnan(rms) else f"{1e3 * rms:.2f} mm RMS, {1e3 * most:.2f} mm at 95 %"


def _limited(times: GoalTimes) -> dict[str, str]:
    """Describe for how long limits acted, and the goal was in doubt or not reached yet."""
    return {LimitingKind.LIMITED.value: "nothing"} | dict(times.rows())


def _overview(shown: NDArray[np.uint8]) -> str:
    """Return an image as an element of the page."""
    done, data = cv2.imencode(
        ".jpg", cv2.cvtColor(shown, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    if not done:
        raise OutputError(f"cannot encode a picture of {shown.shape[1]} x {shown.shape[0]} px")
    return image(data.tobytes(), "The arm during the run", "jpeg")


def _figure(name: str, value: str) -> str:
    words = _VALUE.sub(r'<span class="value">\g<0></span>', html.escape(value))
    return f'<tr><th scope="row">{html.escape(name)}</th><td>{words}</td></tr>'


def _picture(path: Path) -> str:
    """Return a picture below its heading."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise OutputError(f"cannot put {path} into the report: {reason_of(error)}") from error
    caption = _CAPTIONS.get(path.name, path.stem.replace("_", " "))
    shown = picture(data, caption, _SHOWN.get(path.name, ""))
    words = _WORDS.get(path.name, "")
    return f'{shown}\n<p class="quiet">{html.escape(words)}</p>' if words else shown


def _held(log: ServoLog, shaded: str) -> str:
    """Return the times at which the hand was held, and why; nothing if it never was."""
    found = holds(log)
    if not found:
        return ""
    total = sum(hold.seconds for hold in found)
    times = "once" if len(found) == 1 else f"{len(found)} times"
    rows = "\n".join(map(_hold_row, found[:_MOST_HOLDS]))
    more = len(found) - _MOST_HOLDS
    rest = f"<p>And {more} more.</p>" if more > 0 else ""
    table = (
        '<table>\n<thead><tr><th scope="col" class="number">from</th>'
        '<th scope="col" class="number">to</th><th scope="col" class="number">for</th>'
        f'<th scope="col">why</th></tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>'
    )
    return (
        "<h2>Why the hand was held</h2>\n"
        f'<p class="quiet">It was held {times}, for {total:.2f} s in total{shaded}. '
        "Times are in seconds since servoing began.</p>\n"
        f"{scrolling(table, 'Why the hand was held')}\n{rest}"
    )


def _hold_row(hold: Hold) -> str:
    seconds = (hold.start_s, hold.end_s, hold.seconds)
    numbers = "".join(f'<td class="number">{one:.2f} s</td>' for one in seconds)
    why = "; ".join(reason.value for reason in hold.reasons)
    return f"<tr>{numbers}<td>{html.escape(why)}</td></tr>"


def _settings(text: str) -> str:
    if not text:
        return ""
    return (
        "<h2>Settings</h2>\n<details><summary>All settings, as TOML</summary>\n"
        f"<pre>{html.escape(text)}</pre>\n</details>"
    )

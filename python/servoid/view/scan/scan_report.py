"""Builds the report of a scan as one self-contained page."""

import html
import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from servoid.errors import OutputError
from servoid.pose import Floats
from servoid.scan import Scan
from servoid.view.page_parts import fill, image, notes_list, paragraphs, verdict_list
from servoid.words import digits, measured

_THUMB_PX = 220
_QUALITY = 85
_MOST_THUMBS = 60
_MOST_POINTS = 4000
_DRAWN_PX = 460
_MARGIN_PX = 14
_BAR_PX = 18  # below a plan, for the scale bar
_INSIDE = 0.9  # share of the points that a plan shows: distant ones would make all others small


def scan_page(scan: Scan, images: Path) -> bytes:
    """Return the report of a scan whose images are in a folder, as a page of HTML.

    Raises:
        OutputError: a picture cannot be made.

    """
    return fill(
        "scan_report.html",
        {
            "title": html.escape(f"Scan of {scan.source.name}"),
            "verdict": verdict_list(list(_verdict(scan))),
            "words": paragraphs(_words(scan)),
            "notes": notes_list(scan.notes),
            "plans": _plans(scan),
            "unit": _unit(scan),
            "figures": "\n".join(_row(name, value) for name, value in _figures(scan)),
            "thumbs": "\n".join(_thumbs(scan, images)),
        },
    )


def _verdict(scan: Scan) -> Iterator[str]:
    solution = scan.solution
    share = f"{len(solution.names)} of {scan.keys} images were registered"
    unscaled = [one for one in scan.doubts if one.startswith("the scale")]
    doubts = [one for one in scan.doubts if one not in unscaled]
    yield f"{share}." if doubts else f"{share}; no check raised a doubt."
    yield from (f"In doubt: {doubt}." for doubt in doubts)
    yield from (f"{one[0].upper()}{one[1:]}." for one in unscaled)


def _words(scan: Scan) -> list[str]:
    solution = scan.solution
    size = "x".join(map(str, solution.lens.size_px))
    sentences = [
        f"The camera of {size} pixels has a focal length of {solution.focal_px:.1f} px, with a "
        f"standard deviation of {solution.focal_std_px:.1f} px: a horizontal field of view of "
        f"{_view_deg(scan):.1f} degrees. The reprojection error of the features is "
        f"{solution.rms_px:.2f} px (root mean square)."
    ]
    if scan.scale is not None:
        sentences.append(
            f"The scale was found {scan.scale.words}, with a standard deviation of "
            f"{100 * scan.scale.deviation:.2g} %; the median distance from the camera to the "
            f"points is {measured(solution.distance)} m."
        )
    return sentences


def _view_deg(scan: Scan) -> float:
    lens = scan.solution.lens
    return math.degrees(2.0 * math.atan(0.5 * lens.size_px[0] / lens.focal_px[0]))


def _figures(scan: Scan) -> Iterator[tuple[str, str]]:
    solution = scan.solution
    yield "images in the source", str(scan.count)
    yield "images used", str(scan.keys)
    yield "images registered", str(len(solution.names))
    if solution.missing:
        yield "images not registered", ", ".join(solution.missing)
    yield "points", str(len(solution.points))
    parallax = math.degrees(solution.parallax_rad)
    yield "parallax angle of a point, median", f"{parallax:.1f}°"
    yield "angle between directions to the scene, largest", f"{math.degrees(scan.around_rad):.0f}°"
    u, v = solution.lens.center_px
    found = "estimated" if solution.center_is_found else "assumed to be the image centre"
    yield "principal point", f"{u:.1f}, {v:.1f} px, {found}"
    yield "distortion k1", f"{solution.lens.distortion[0]:.4f}"
    yield "time of the scan", f"{scan.seconds:.1f} s"


def _row(name: str, value: str) -> str:
    return f'<tr><th scope="row">{html.escape(name)}</th><td>{html.escape(value)}</td></tr>'


def _plans(scan: Scan) -> str:
    """Draw points and cameras from above and from the side, as the cameras were held."""
    solution = scan.solution
    turns = np.array([pose.matrix()[:3, :3] for pose in solution.world_from_camera])
    up = -turns[:, :, 1].mean(axis=0)
    up /= np.linalg.norm(up)
    ahead = turns[0, :, 2] - up * float(turns[0, :, 2] @ up)
    if np.linalg.norm(ahead) < 1e-6:
        ahead = turns[0, :, 1] - up * float(turns[0, :, 1] @ up)
    ahead /= np.linalg.norm(ahead)
    side = np.cross(ahead, up)
    drawings = (
        ("From above; the first camera looks up the page", np.stack([side, -ahead])),
        ("From the side", np.stack([ahead, -up])),
    )
    return "\n".join(_plan(scan, axes, turns[:, :, 2], title) for title, axes in drawings)


def _plan(scan: Scan, axes: Floats, looking: Floats, title: str) -> str:
    """Draw one plan as SVG: `axes` (2, 3) go right and down the page."""
    solution = scan.solution
    step = max(1, len(solution.points) // _MOST_POINTS)
    places, points = solution.places @ axes.T, solution.points[::step] @ axes.T
    low, high = np.quantile(points, [(1 - _INSIDE) / 2, (1 + _INSIDE) / 2], axis=0)
    low, high = np.minimum(low, places.min(axis=0)), np.maximum(high, places.max(axis=0))
    by = (_DRAWN_PX - 2 * _MARGIN_PX) / max(float((high - low).max()), 1e-9)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    dots = "".join(_dot(*at) for at in (points[inside] - low) * by + _MARGIN_PX)
    stops = (places - low) * by + _MARGIN_PX
    heads = looking @ axes.T
    marks = "".join(
        f'<line x1="{u:.1f}" y1="{v:.1f}" x2="{u + 12 * du:.1f}" y2="{v + 12 * dv:.1f}"/>'
        f'<circle cx="{u:.1f}" cy="{v:.1f}" r="3"><title>{html.escape(name)}</title></circle>'
        for (u, v), (du, dv), name in zip(stops, heads, solution.names, strict=True)
    )
    height = float((high - low)[1] * by) + 2 * _MARGIN_PX + _BAR_PX
    bar = _bar(by, height, " m" if scan.scale is not None else "")
    return (
        f'<figure><svg viewBox="0 0 {_DRAWN_PX} {height:.0f}" role="img" '
        f'aria-label="{html.escape(title)}"><path class="points" d="{dots}"/>'
        f'<g class="cameras">{marks}</g>{bar}</svg>'
        f"<figcaption>{html.escape(title)}</figcaption></figure>"
    )


def _unit(scan: Scan) -> str:
    """Return what the numbers at the scale bars mean, if they are not metres."""
    return "" if scan.scale is not None else "The bars have the unit of lengths above."


def _bar(by: float, height: float, unit: str) -> str:
    """Draw a bar of a round length, at most a quarter of the plan long; `by` is pixels per unit."""
    longest = 0.25 * _DRAWN_PX / by
    ten = 10.0 ** math.floor(math.log10(longest))
    length = max(step * ten for step in (0.5, 1.0, 2.0, 5.0) if step * ten <= longest)
    left, right, v = _MARGIN_PX, _MARGIN_PX + length * by, height - 8.0
    return (
        f'<g class="scale"><line x1="{left}" y1="{v:.1f}" x2="{right:.1f}" y2="{v:.1f}"/>'
        f'<text x="{right + 6:.1f}" y="{v + 4:.1f}">{digits(length)}{unit}</text></g>'
    )


def _dot(u: float, v: float) -> str:
    return f"M{u:.1f} {v:.1f}h.1"


def _thumbs(scan: Scan, images: Path) -> Iterator[str]:
    """Show the images with their triangulated features, unregistered ones too."""
    solution = scan.solution
    files = sorted(path for path in images.iterdir())
    step = max(1, -(-len(files) // _MOST_THUMBS))
    shown = [file for n, file in enumerate(files) if n % step == 0 or file.stem in solution.missing]
    for file in shown:
        index = solution.index(file.stem)
        if index is None:
            words, kind = "not registered", "missing"
        else:
            count, off = len(solution.seen[index]), solution.error_px[index]
            words, kind = f"{count} points, {off:.2f} px", "found"
        marks = None if index is None else solution.marks_px[index]
        data = _thumb(file, marks)
        name = html.escape(file.stem)
        yield (
            f'<figure class="{kind}">{image(data, f"Image {file.stem}: {words}", "jpeg")}'
            f"<figcaption>{name}<br>{words}</figcaption></figure>"
        )


def _thumb(file: Path, marks: Floats | None) -> bytes:
    pixels = cv2.imread(str(file), cv2.IMREAD_COLOR)
    if pixels is None:
        raise OutputError(f"cannot show {file.name} in the report: it cannot be decoded")
    by = _THUMB_PX / max(pixels.shape[:2])
    size = (max(1, round(by * pixels.shape[1])), max(1, round(by * pixels.shape[0])))
    small = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    for u, v in np.empty((0, 2)) if marks is None else marks:
        at = (round((u + 0.5) * by), round((v + 0.5) * by))
        cv2.circle(small, at, 1, (60, 220, 60), -1)
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    if not done:
        raise OutputError(f"cannot show {file.name} in the report")
    return data.tobytes()

"""The report as one page that needs nothing beside it: words, pictures, and a body to turn."""

import base64
import html
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.model import ModelResult
from servoid.view.body_picture import (
    FROM_AHEAD,
    RISE_DEG,
    TURN_DEG,
    frustum,
    mean_up,
    side_and_front,
    solids_in_world,
)
from servoid.view.raycast import Solids
from servoid.view.scores import UNUSED_COLOR, USED_COLOR, ScoredView, score_words, scored_views

_FRUSTUM_SHARE = 0.085  # of the distance of the farthest camera
_DIGITS = 7

_CAPTIONS = {
    "body.png": "The body from four sides, and the cameras",
    "contact_sheet.png": "The views, with the ellipsoids' outlines",
    "curve.png": "Fitness and silhouette IoU against the count",
}


def html_page(result: ModelResult, pictures: Mapping[str, bytes], notes: Sequence[str]) -> bytes:
    """Return the page. `pictures` are PNG files by name; `notes` are sentences that go on top."""
    scored = scored_views(result)
    count = len(result.body)
    parts = {
        "title": f"A body of {count} ellipsoid{'' if count == 1 else 's'}",
        "words": "\n".join(f"<p>{html.escape(line)}</p>" for line in _words(result, scored)),
        "notes": _notes(notes),
        "legend": _legend(scored),
        "hidden": "" if scored else " hidden",
        "pictures": "\n".join(_picture(name, data) for name, data in pictures.items()),
        "rows": "\n".join(_rows(scored)),
        "scene": _json(_scene(result, scored)),
        "script": _read("turntable.js"),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match.group(1)], _read("report.html"))
    return page.encode()


def _read(name: str) -> str:
    return files("servoid.view").joinpath(name).read_text(encoding="utf-8")


def _json(data: Any) -> str:
    """Return JSON that no `</script>` can end."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _words(result: ModelResult, scored: list[ScoredView]) -> Iterator[str]:
    yield score_words(scored, len(result.body)) + f"; fitness F {result.fitness:.4f}."
    solids = solids_in_world(result.body, result.colors)
    axes = result.body.world_from_object.matrix()[:3, :3].T
    spans = (high - low for low, high in (solids.extent(axis) for axis in axes))
    size = " × ".join(_plain(1000.0 * span) for span in spans)
    volume = _plain(1e6 * result.body.mass_properties()[0])
    yield f"It measures {size} mm along its axes and holds {volume} cm³."
    settings = result.settings
    yield (
        f"It was modelled in {result.seconds:.2f} s from {_sources(result, scored)}, with at most "
        f"{settings.max_ellipsoids} ellipsoids, δ = {settings.delta:g} and seed {settings.seed}."
    )
    if result.targets:
        yield f"The object was marked by {', '.join(result.targets)}."


def _sources(result: ModelResult, scored: list[ScoredView]) -> str:
    """Say in words what the body was modelled from."""
    parts = []
    if scored:
        parts.append(f"{len(result.used_views)} of {len(scored)} views")
    if len(result.sights):
        parts.append(f"{len(result.sights)} seen points")
    return " and ".join(parts) or "a mesh"


def _plain(value: float) -> str:
    """Return four digits that count, without an exponent."""
    return np.format_float_positional(value, precision=4, fractional=False, trim="-")


def _notes(notes: Sequence[str]) -> str:
    items = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return f'<ul class="notes">{items}</ul>' if items else ""


def _legend(scored: list[ScoredView]) -> str:
    kinds = sorted({one.use for one in scored}, reverse=True)
    if not kinds:
        return ""
    return "Cameras: " + ", ".join(f'<span class="{kind}">{kind}</span>' for kind in kinds) + "."


def _picture(name: str, data: bytes) -> str:
    caption = html.escape(_CAPTIONS.get(name, name))
    encoded = base64.b64encode(data).decode()
    return f'<h2>{caption}</h2>\n<img alt="{caption}" src="data:image/png;base64,{encoded}">'


def _rows(scored: list[ScoredView]) -> Iterator[str]:
    worst = min(scored, key=lambda one: one.iou, default=None)
    for one in scored:
        kind = ' class="worst"' if one is worst else ""
        names = (one.view.name, one.view.image_path.name)
        cells = "".join(f"<td>{html.escape(name)}</td>" for name in names)
        yield (
            f'<tr{kind}>{cells}<td class="{one.use}">{one.use}</td>'
            f'<td class="number">{one.iou:.4f}</td></tr>'
        )


def _scene(result: ModelResult, scored: list[ScoredView]) -> dict[str, Any]:
    """Return what the page draws: the body about the origin with a radius of about 1."""
    solids = solids_in_world(result.body, result.colors)
    poses = [one.view.world_from_camera.matrix() for one in scored]
    up = mean_up(scored)
    side, front = side_and_front(solids, up, poses[0][:3, 3] if poses else FROM_AHEAD)
    middle, radius = _around(solids, np.stack([side, front, up]))
    reach = max((float(np.linalg.norm(pose[:3, 3] - middle)) for pose in poses), default=1.0)
    cameras = []
    for one, pose in zip(scored, poses, strict=True):
        points = (frustum(one, pose, _FRUSTUM_SHARE * reach) - middle) / radius
        cameras.append(
            {"points": _round(points), "color": USED_COLOR if one.used else UNUSED_COLOR}
        )
    ellipsoids = [
        {
            "center": _round((center - middle) / radius),
            "to_ball": _round(np.linalg.inv(np.linalg.cholesky(shape)) * radius),
            "color": color.tolist(),
        }
        for center, shape, color in zip(solids.centers, solids.shapes, solids.colors, strict=True)
    ]
    return {
        "ellipsoids": ellipsoids,
        "cameras": cameras,
        "reach": float(f"{max(1.0, reach / radius):.6g}"),
        "side": _round(side),
        "front": _round(front),
        "up": _round(up),
        "turn": float(np.radians(TURN_DEG)),
        "rise": float(np.radians(RISE_DEG)),
    }


def _around(solids: Solids, axes: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the middle of the box around the ellipsoids, and half its longest side."""
    spans = np.array([solids.extent(axis) for axis in axes])
    middle = axes.T @ spans.mean(axis=1)
    return middle, float((spans[:, 1] - spans[:, 0]).max() / 2.0)


def _round(values: NDArray[np.float64]) -> Any:
    # Single precision is what a page draws with.
    return (
        np.array([float(f"{value:.{_DIGITS}g}") for value in values.ravel()])
        .reshape(values.shape)
        .tolist()
    )

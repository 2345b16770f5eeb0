"""Builds the report as one self-contained page: text, pictures, and an interactive view."""

import html
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from servoid.model import GOOD_IOU, ModelResult, PaperSettings
from servoid.shape import body_sides
from servoid.view.body_picture import (
    FROM_AHEAD,
    frustum,
    mean_up,
    side_and_front,
    solids_in_world,
)
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
)
from servoid.view.scores import (
    UNUSED_COLOR,
    USED_COLOR,
    ScoredView,
    score_words,
    scored_views,
    verdict,
)
from servoid.view.turntable import Frustum, around, turntable_scene
from servoid.words import counted, four_digits, lengths

_FRUSTUM_SHARE = 0.085  # share of the distance of the farthest camera

_SHOWN = {
    "body.png": "The body drawn from four sides and, beside it, the camera poses or a fifth side",
    "contact_sheet.png": "Photographs with the outline of each ellipsoid drawn over the object",
    "curve.png": "Lines over the count of ellipsoids: fitness F, and IoU of any views; "
    "the table of steps in summary.json has the numbers",
}

_CAPTIONS = {
    "body.png": "The body from four sides, and the cameras",
    "contact_sheet.png": "The views, with the ellipsoids' outlines",
    "curve.png": "Fitness and silhouette IoU against the count",
}
_CAPTIONS_WITHOUT_VIEWS = {
    "body.png": "The body from five sides",
    "curve.png": "Fitness F against the count",
}
_COLUMNS = (
    '<th scope="col">view</th><th scope="col">image</th><th scope="col">modelling</th>'
    '<th scope="col" class="number">silhouette IoU</th>'
)


def html_page(
    result: ModelResult, pictures: Mapping[str, bytes], notes: Sequence[str], source: str
) -> bytes:
    """Return the page. `pictures` are PNG files; the page begins with `source` and `notes`."""
    scored = scored_views(result)
    doubts = result.all_doubts
    count = len(result.body)
    captions = _CAPTIONS if scored else _CAPTIONS_WITHOUT_VIEWS
    parts = {
        "title": f"A body of {counted(count, 'ellipsoid')}",
        "origin": origin(source),
        "verdict": verdict_list(verdict(result.verdict, scored, doubts)),
        "words": paragraphs(list(_words(result, scored))),
        "notes": notes_list([note for note in notes if note not in doubts]),
        "legend": _legend(scored),
        "hidden": "" if scored else " hidden",
        "pictures": "\n".join(
            picture(data, captions.get(name, name), _SHOWN.get(name, ""))
            for name, data in pictures.items()
        ),
        "views": _table(scored),
        "scene": json_text(_scene(result, scored)),
        "script": read("turntable.js"),
    }
    return fill("report.html", parts)


def _words(result: ModelResult, scored: list[ScoredView]) -> Iterator[str]:
    yield (
        f"{score_words(scored, len(result.body))}; fitness F {result.fitness:.4f}. "
        f"{_fitness_words(result)}"
    )
    spans = body_sides(result.body).tolist()
    volume_m3 = result.body.mass_properties()[0]
    if result.is_metric:
        size = f"{lengths([1000.0 * span for span in spans])} mm"
        volume = f"{four_digits(1e6 * volume_m3)} cm³"
    else:
        size = f"{lengths(spans)} of an unknown unit"
        volume = f"{four_digits(volume_m3)} cubic units"
    yield (
        f"It measures {size} along x, y and z of its frame, which are its principal axes of "
        f"inertia, so x need not be the longest. Its volume is {volume}."
    )
    settings = result.settings
    yield (
        f"It was modelled in {result.seconds:.2f} s from {_sources(result, scored)}, with at most "
        f"{settings.max_ellipsoids} ellipsoids, δ = {settings.delta:g} and seed {settings.seed}."
    )
    if result.targets:
        yield f"The object was marked by {', '.join(result.targets)}."


def _sources(result: ModelResult, scored: list[ScoredView]) -> str:
    """Describe the data that the body was modelled from."""
    parts = []
    if scored:
        parts.append(f"{len(result.used_views)} of {len(scored)} views")
    if len(result.range_samples):
        parts.append(f"{len(result.range_samples)} range samples")
    return " and ".join(parts) or "a mesh"


def _fitness_words(result: ModelResult) -> str:
    """Say in a sentence what F is, which depends on what the body was modelled from."""
    if isinstance(result.settings, PaperSettings):
        return (
            "F is that of the paper: surface points on the object count +1, and "
            "points of an envelope around the body -1."
        )
    outlines, lines = "of mask and silhouette over the used views", "along the range samples"
    if result.used_views and len(result.range_samples):
        of = f"{outlines}, and of body and object {lines}, as their geometric mean"
    elif result.used_views:
        of = outlines
    elif result.outline is not None:
        of = (
            f"of body and object {lines}, and of the cloud's outline and the silhouette from its "
            "viewpoint, as a geometric mean in which the outline counts more"
        )
    elif len(result.range_samples):
        of = f"of body and object {lines}"
    else:
        of = (
            "of body and mesh, by volume and by silhouette from six sides, as a geometric mean "
            "in which the volume counts more"
        )
    return f"F is the mean intersection over union {of}; 1 is a perfect fit."


def _legend(scored: list[ScoredView]) -> str:
    kinds = sorted({one.use for one in scored}, reverse=True)
    if not kinds:
        return ""
    return "Cameras: " + ", ".join(f'<span class="{kind}">{kind}</span>' for kind in kinds) + "."


def _table(scored: list[ScoredView]) -> str:
    """Return the table of the views with its heading; empty without views."""
    if not scored:
        return ""
    rows = "\n".join(_rows(scored))
    table = f"<table>\n<thead><tr>{_COLUMNS}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>"
    return f"<h2>Views</h2>\n{scrolling(table, 'Views')}"


def _rows(scored: list[ScoredView]) -> Iterator[str]:
    worst = min(scored, key=lambda one: one.iou, default=None)
    for one in scored:
        kinds = ["worst"] if one is worst else []
        kinds += ["poor"] if one.iou < GOOD_IOU else []
        kind = f' class="{" ".join(kinds)}"' if kinds else ""
        names = (one.view.name, one.view.image_path.name)
        cells = "".join(f"<td>{html.escape(name)}</td>" for name in names)
        yield (
            f'<tr{kind}>{cells}<td class="{one.use}">{one.use}</td>'
            f'<td class="number">{one.iou:.4f}</td></tr>'
        )


def _scene(result: ModelResult, scored: list[ScoredView]) -> dict[str, Any]:
    """Return what the page draws: the body, and the cameras that saw it."""
    solids = solids_in_world(result.body, result.colors)
    poses = [one.view.world_from_camera.matrix() for one in scored]
    up = mean_up(scored)
    side, front = side_and_front(solids, up, poses[0][:3, 3] if poses else FROM_AHEAD)
    axes = (side, front, up)
    middle, _ = around(solids, np.stack(axes))
    reach = max((float(np.linalg.norm(pose[:3, 3] - middle)) for pose in poses), default=1.0)
    frusta = [
        Frustum(
            frustum(one, pose, _FRUSTUM_SHARE * reach), USED_COLOR if one.used else UNUSED_COLOR
        )
        for one, pose in zip(scored, poses, strict=True)
    ]
    return turntable_scene(solids, axes, frusta, reach)

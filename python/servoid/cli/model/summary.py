"""The one-screen summary of a model, at most 80 columns wide except for paths."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import typer
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.cli.rows import Row, wrapped
from servoid.model import ModelResult
from servoid.pose import exact
from servoid.shape import body_sides
from servoid.words import counted, lengths, measured

_LABEL_WIDTH = 15
_VALUE_WIDTH = 80 - len("  ") - _LABEL_WIDTH - len(" ")


def print_summary(source: str, result: ModelResult, out: Path, pictures: Sequence[Path]) -> None:
    """Print what was modelled, how good it is, and where the files are."""
    typer.echo(f"Modelled {source}")
    for label, value in _rows(result, out, pictures):
        typer.echo(f"  {label:<{_LABEL_WIDTH}} {value}")


def _rows(result: ModelResult, out: Path, pictures: Sequence[Path]) -> Iterator[Row]:
    yield from wrapped("verdict", result.verdict.words, _VALUE_WIDTH)
    for doubt in result.all_doubts:
        yield from wrapped("doubt", doubt, _VALUE_WIDTH)
    yield "ellipsoids", str(len(result.body))
    yield "fitness F", f"{result.fitness:.4f}"
    if result.used_views:
        yield "silhouette IoU", _ious("used", result.used_views, result.iou_used)
    if result.unused_views:
        yield "", _ious("unused", result.unused_views, result.iou_unused)
    if len(result.range_samples):
        yield "range samples", f"{len(result.range_samples)}"
    yield from wrapped("size", _size(result), _VALUE_WIDTH)
    if result.coverage is not None:
        yield "surface seen", f"{100.0 * result.coverage.share:.0f} %"
    yield "seconds", f"{result.seconds:.2f}"
    yield "body", str(out)
    for index, picture in enumerate(pictures):
        yield "" if index else "report", str(picture)
    for note in result.all_notes:
        if note not in result.all_doubts:
            yield from wrapped("note", note, _VALUE_WIDTH)


def _size(result: ModelResult) -> str:
    """Describe the size of the body, and how far it is from the first camera that saw it."""
    sides, unit = body_sides(result.body), "of an unknown unit"
    if result.is_metric:
        sides, unit = 1000.0 * sides, "mm"
    text = f"{lengths(sides.tolist())} {unit}"
    if not result.used_views:
        return text
    view = result.used_views[0]
    camera_from_body = view.world_from_camera.inverse() @ result.body.world_from_object
    away = measured(exact.norm(np.array(camera_from_body.translation)))
    return f"{text}, {away} {'m ' if result.is_metric else ''}from the first view"


def _ious(kind: str, views: Sequence[CaptureView], ious: NDArray[np.float64]) -> str:
    worst = int(np.argmin(ious))
    count = counted(len(views), f"{kind} view")
    text = f"{ious.mean():.4f} over {count}, worst {ious[worst]:.4f}"
    name = views[worst].name
    room = _VALUE_WIDTH - len(f"{text} ()")
    return f"{text} ({name if len(name) <= room else '…' + name[1 - room :]})"

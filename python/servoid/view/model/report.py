"""Writes the report of a model: a page, pictures and figures that show how good a body is."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from servoid.model import ModelResult
from servoid.view.body_picture import draw_body
from servoid.view.model.contact_sheet import draw_contact_sheet
from servoid.view.model.curve import draw_curve
from servoid.view.model.html_page import html_page
from servoid.view.page_parts import write_report_files
from servoid.view.scores import ScoredView, mean_iou, scored_views
from servoid.words import finite


def write_report(
    result: ModelResult, directory: Path, *, notes: Sequence[str] = (), source: str = ""
) -> list[Path]:
    """Write the pictures and the figures of a result into a folder; return the files' paths.

    They are `report.html` (everything on one page, with an interactive view of the body),
    `contact_sheet.png` (the views with the ellipsoids' outlines, if there are views), `curve.png`
    (fitness and silhouette IoU against the count), `body.png` (the body from four sides, and the
    cameras) and `summary.json`. The page begins with `source`, what was modelled, and the
    sentences `notes`. The folder is created if it is missing; other files in it stay unchanged.

    Raises:
        ImageError, MaskError: a view's file can no longer be read.
        OutputError: the folder cannot be written; then no file of the report in it changes.

    """
    directory = Path(directory)
    pictures = {
        "body.png": draw_body(result),
        **({"contact_sheet.png": draw_contact_sheet(result)} if result.used_views else {}),
        "curve.png": draw_curve(result),
    }
    files = {
        "report.html": html_page(result, pictures, notes, source),
        **pictures,
        "summary.json": (json.dumps(summarise(result), indent=2) + "\n").encode(),
    }
    return write_report_files(directory, files)


def summarise(result: ModelResult) -> dict[str, Any]:
    """Return the figures of the report, ready for JSON; None where there is no view."""
    scored = scored_views(result)
    ious = result.iou_by_count
    steps = zip(result.steps, ious.used, ious.unused, strict=True)
    verdict = result.verdict
    return {
        "verdict": verdict.word,
        "reason": verdict.reason,
        "doubts": list(result.all_doubts),
        "count": len(result.body),
        "fitness": result.fitness,
        "seconds": result.seconds,
        "iou_used": mean_iou(scored, used=True),
        "iou_unused": mean_iou(scored, used=False),
        "views": [_view_row(one) for one in scored],
        "steps": [
            {
                "count": step.count,
                "fitness": step.fitness,
                "iou_used": finite(used),
                "iou_unused": finite(unused),
            }
            for step, used, unused in steps
        ],
    }


def _view_row(one: ScoredView) -> dict[str, Any]:
    return {
        "view": one.view.name,
        "image": one.view.image_path.name,
        "used": one.used,
        "iou": one.iou,
    }

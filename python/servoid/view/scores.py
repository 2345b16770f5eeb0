"""Scores views, for the pictures and sentences of the report."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.capture import CaptureView
from servoid.model import GOOD_IOU, ModelResult, ModelVerdict
from servoid.words import counted

_MOST_NAMED = 5

USED_COLOR = (31, 90, 166)
UNUSED_COLOR = (176, 80, 8)


@dataclass(frozen=True, eq=False)
class ScoredView:
    """A view, whether modelling used it, and the silhouette IoU of the body in it."""

    view: CaptureView
    used: bool
    iou: float

    @property
    def use(self) -> str:
        """Return `used` if modelling used the view, otherwise `unused`."""
        return "used" if self.used else "unused"


def scored_views(result: ModelResult) -> list[ScoredView]:
    """List all views of a result, camera by camera and in the order of their images."""
    scored = [
        ScoredView(view, used, float(iou))
        for views, ious, used in (
            (result.used_views, result.iou_used, True),
            (result.unused_views, result.iou_unused, False),
        )
        for view, iou in zip(views, ious, strict=True)
    ]
    return sorted(scored, key=lambda scored: (scored.view.camera_name, scored.view.index))


def mean_iou(scored: list[ScoredView], *, used: bool) -> float | None:
    """Return the mean silhouette IoU over the used or the unused views; None if there is none."""
    ious = [one.iou for one in scored if one.used is used]
    return float(np.mean(ious)) if ious else None


def verdict(rated: ModelVerdict, scored: list[ScoredView], doubts: Sequence[str] = ()) -> list[str]:
    """Return sentences: whether a body is good, its doubts, and which views it does not explain."""
    words = rated.words[0].upper() + rated.words[1:]
    doubted = [f"In doubt: {doubt}." for doubt in doubts]
    if not scored:
        return [f"{words}.", *doubted]
    sentences = [f"{words}, measured by the IoU of mask and silhouette.", *doubted]
    poor = sorted((one for one in scored if one.iou < GOOD_IOU), key=lambda one: one.iou)
    if poor:
        names = ", ".join(one.view.name for one in poor[:_MOST_NAMED])
        more = f" and {len(poor) - _MOST_NAMED} more" if len(poor) > _MOST_NAMED else ""
        verb = "view has" if len(poor) == 1 else "views have"
        sentences.append(
            f"{len(poor)} of {len(scored)} {verb} less than {100.0 * GOOD_IOU:g} %: {names}"
            f"{more}. Look at their masks and poses first."
        )
    return sentences


def score_words(scored: list[ScoredView], count: int) -> str:
    """Return one line with the number of ellipsoids and how well they fit."""
    words = counted(count, "ellipsoid")
    parts = []
    for used in (True, False):
        mean = mean_iou(scored, used=used)
        if mean is not None:
            number = sum(one.used is used for one in scored)
            kind = "used" if used else "unused"
            parts.append(f"{mean:.3f} over {counted(number, f'{kind} view')}")
    return f"{words}, silhouette IoU {', '.join(parts)}" if parts else words

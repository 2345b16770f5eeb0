"""Views with their scores: what every picture of the report starts from."""

from dataclasses import dataclass

import numpy as np

from servoid.model import ModelResult
from servoid.observe import CaptureView

USED_COLOR = (31, 90, 166)
UNUSED_COLOR = (214, 112, 28)


@dataclass(frozen=True, eq=False)
class ScoredView:
    """A view, whether modelling used it, and the silhouette IoU of the body in it."""

    view: CaptureView
    used: bool
    iou: float

    @property
    def use(self) -> str:
        """Say in a word whether modelling used the view."""
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


def score_words(scored: list[ScoredView], count: int) -> str:
    """Say in one line how many ellipsoids there are and how well they fit."""
    words = f"{count} ellipsoid{'' if count == 1 else 's'}"
    parts = []
    for used in (True, False):
        mean = mean_iou(scored, used=used)
        if mean is not None:
            number = sum(one.used is used for one in scored)
            kind = "used" if used else "unused"
            parts.append(f"{mean:.3f} over {number} {kind} view{'' if number == 1 else 's'}")
    return f"{words}, silhouette IoU {', '.join(parts)}" if parts else words

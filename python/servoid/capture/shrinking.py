"""Shrinks views as they are read, to bound the memory that many photographs take."""

from collections.abc import Sequence
from dataclasses import replace

from servoid._native import Lens
from servoid.camera import IdealCamera, Recorded, needs_object, shrink_mask
from servoid.capture.capture import CaptureView
from servoid.config import MOST_VIEW_PX
from servoid.words import counted


def shrunk(views: Sequence[CaptureView]) -> tuple[list[CaptureView], str | None]:
    """Return views whose images fit into memory together, and a message if they were shrunk.

    All are shrunk by the same power of two as they are read. Views with masks in their pinholes'
    pixels, and views of images in memory, are not shrunk.
    """
    free = [view for view in views if _is_free(view)]
    pixels = sum(width * height for width, height in (view.lens.size_px for view in free))
    by = 1
    while pixels > MOST_VIEW_PX * by * by:
        by *= 2
    if by == 1:
        return list(views), None
    small: dict[int, IdealCamera] = {}
    made = [_shrunk(view, by, small) if _is_free(view) else view for view in views]
    before, after = free[0].lens.size_px, _small(free[0].lens, by).size_px
    return made, (
        f"{counted(len(free), 'image')} of {before[0]}x{before[1]} pixels were shrunk to "
        f"{after[0]}x{after[1]} as they were read, so that they fit into memory; fewer, such "
        "as --observations ::4, are shrunk less"
    )


def _is_free(view: CaptureView) -> bool:
    return view.given_mask is None and not view.picture.is_in_memory


def _shrunk(view: CaptureView, by: int, small: dict[int, IdealCamera]) -> CaptureView:
    """Shrink one view; views that share a lens still share a pinhole and its maps."""
    ideal = small.setdefault(id(view.lens), IdealCamera(_small(view.lens, by)))
    recorded = view.recorded
    own = needs_object(view.lens) and view.has_mask
    return replace(
        view,
        lens=ideal.lens,
        shrinking=Recorded(recorded.size_px, recorded.by * by),
        recorded_mask=None if view.recorded_mask is None else shrink_mask(view.recorded_mask, by),
        shared=None if own else ideal,
    )


def _small(lens: Lens, by: int) -> Lens:
    width, height = lens.size_px
    (fx, fy), (cx, cy) = lens.focal_px, lens.center_px
    return Lens(
        model=lens.model,
        size_px=(max(1, width // by), max(1, height // by)),
        focal_px=(fx / by, fy / by),
        # Pixel (0, 0) is the centre of the top-left pixel.
        center_px=((cx + 0.5) / by - 0.5, (cy + 0.5) / by - 0.5),
        distortion=lens.distortion,
    )

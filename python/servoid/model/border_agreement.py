"""Compares given masks with the edges of their images."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.model.running import in_parallel
from servoid.segment import border_rank, fitting_shift
from servoid.words import counted

_MOST = 24  # views that are compared, evenly chosen
_LEAST_RANK = (
    0.8  # of a single mask; those of recordings, drawn ones and hand-drawn ones reach 0.81
)
_LEAST_MEAN = (
    0.9  # of three masks or more; those of photographs have 1.0, exchanged ones 0.6 to 0.94
)
_FEW = 3
_FITS = 0.97  # mean rank of another assignment that fits
_ALIKE = 0.05  # of the object's size, by which displacements of most views may differ

Image = NDArray[np.uint8]
Change = Callable[[Image], Image]


def border_notes(views: Sequence[CaptureView]) -> list[str]:
    """Report masks whose borders do not lie on edges of their images; empty if they do.

    Raises:
        ImageError, MaskError: a file cannot be used.

    """
    seen = [view for view in views if view.has_image and view.has_mask]
    seen = [
        seen[place] for place in np.linspace(0, len(seen) - 1, min(_MOST, len(seen)), dtype=int)
    ]
    told = in_parallel(lambda view: border_rank(view.image(), view.mask()), seen)
    ranks = {view.name: rank for view, rank in zip(seen, told, strict=True) if rank is not None}
    bad = [name for name, rank in ranks.items() if rank < _LEAST_RANK]
    mean = float(np.mean(list(ranks.values()))) if ranks else 1.0
    if not bad and (len(ranks) < _FEW or mean >= _LEAST_MEAN):
        return []
    if len(seen) == 1:
        return [
            f"the border of the mask in {seen[0].name} does not lie on edges of its image; look "
            "whether the mask is of this image, displaced, or too wide or too narrow"
        ]
    worst = min(ranks, key=ranks.__getitem__)
    where = (
        f"in {len(bad)} of {counted(len(ranks), 'view')}, such as {worst}"
        if bad
        else f"in many of {counted(len(ranks), 'view')}, least in {worst}"
    )
    better = _better(seen) if mean < _LEAST_MEAN and len(ranks) >= _FEW else None
    return [
        f"the borders of masks do not lie on edges of their images {where}; "
        + (f"they do if {better}: " if better else "")
        + "check that each mask is that of its image, of the same place and size"
    ]


def _better(views: Sequence[CaptureView]) -> str | None:
    """Say what makes the masks fit their images; None if nothing that was tried does."""
    for words, order, change in _changes(len(views)):
        shown = [views[place] for place in order]
        ranks = in_parallel(partial(_rank, change), zip(shown, views, strict=True))
        found = [rank for rank in ranks if rank is not None]
        if len(found) >= _FEW and np.mean(found) >= _FITS:
            return words
    return _displaced(views)


def _changes(count: int) -> Iterator[tuple[str, list[int], Change]]:
    """Yield what is tried: words, the place of each mask's image, and what becomes of the image."""
    places = list(range(count))
    yield "the images are mirrored", places, lambda image: image[:, ::-1]
    yield "the images are rotated by 180 degrees", places, lambda image: image[::-1, ::-1]
    yield "each has the image of the next one", [*places[1:], places[0]], _same
    yield "each has the image of the one before", [places[-1], *places[:-1]], _same
    yield "the order of the images is reversed", places[::-1], _same


def _same(image: Image) -> Image:
    return image


def _rank(change: Change, pair: tuple[CaptureView, CaptureView]) -> float | None:
    shown, masked = pair
    image, mask = change(shown.image()), masked.mask()
    return border_rank(image, mask) if image.shape[:2] == mask.shape else None


def _displaced(views: Sequence[CaptureView]) -> str | None:
    """Return by how much all masks are beside the object, if they are by the same."""
    views = views[:: max(1, len(views) // _FEW)]
    told = in_parallel(lambda view: fitting_shift(view.image(), view.mask()), views)
    shifts = np.array([shift for shift in told if shift is not None])
    if len(shifts) < _FEW:
        return None
    usual = np.median(shifts[:, :2], axis=0)
    allowed = _ALIKE * shifts[:, 2]
    if np.abs(usual).max() <= allowed.min():
        return None
    if np.mean(np.abs(shifts[:, :2] - usual).max(axis=1) <= allowed) < 0.5:
        return None
    x, y = np.rint(usual).astype(int)
    return f"they are moved by ({x}, {y}) pixels"

"""Compares given masks with the edges of their images."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.errors import ImageError, MaskError
from servoid.model.running import in_parallel
from servoid.segment import border_rank, fitting_shift
from servoid.words import counted

_MOST, _TRIED = 24, 6  # views that are compared, and on which changes are tried, evenly chosen
_LEAST_RANK = 0.8  # of a single mask; right ones, and drawn by hand, reach 0.81
_BAD_RANK = 0.6  # of one among several, below which it is in doubt by itself
_LEAST_MEAN = 0.9  # of several; masks of photographs reach 1, exchanged ones 0.6 to 0.94
_FEW = 3
_FITS = 0.97  # mean rank of another assignment that fits
_ALIKE = 0.05  # of the object's size, by which displacements of most views may differ

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class _Change:
    """What may be wrong with images: which one a mask should have, or how it should look.

    `place` returns the place of the image for that of a mask among so many views of a camera.
    """

    words: str
    place: Callable[[int, int], int] = lambda at, _: at
    looks: Callable[[Image], Image] = lambda image: image


_CHANGES = (
    _Change("the images are mirrored", looks=lambda image: image[:, ::-1]),
    _Change("the images are rotated by 180 degrees", looks=lambda image: image[::-1, ::-1]),
    _Change("each has the image of the next one", lambda at, count: (at + 1) % count),
    _Change("each has the image of the one before", lambda at, count: (at - 1) % count),
    _Change("the order of the images is reversed", lambda at, count: count - 1 - at),
)


def border_notes(views: Sequence[CaptureView]) -> list[str]:
    """Report masks whose borders do not lie on edges of their images; empty if they do.

    What cannot be read is not compared: it is reported where it is needed.
    """
    seen = [view for view in views if view.has_image and view.has_mask]
    chosen = _evenly(seen, _MOST)
    told = in_parallel(_rank, zip(chosen, chosen, strict=True))
    ranks = {view.name: rank for view, rank in zip(chosen, told, strict=True) if rank is not None}
    bad = [name for name, rank in ranks.items() if rank < _LEAST_RANK]
    mean = float(np.mean(list(ranks.values()))) if ranks else 1.0
    if len(ranks) < _FEW:
        is_doubted = bool(bad)
    else:
        is_doubted = mean < _LEAST_MEAN or len(bad) > 1 or min(ranks.values()) < _BAD_RANK
    if not is_doubted:
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


def _evenly(views: Sequence[CaptureView], most: int) -> list[CaptureView]:
    places = np.linspace(0, len(views) - 1, min(most, len(views)), dtype=int)
    return [views[place] for place in places]


def _better(views: Sequence[CaptureView]) -> str | None:
    """Say what makes the masks fit their images; None if nothing that was tried does."""
    cameras = {view.camera_name for view in views}
    by_camera = {name: [one for one in views if one.camera_name == name] for name in cameras}
    places = {one.name: at for own in by_camera.values() for at, one in enumerate(own)}
    tried = _evenly(views, _TRIED)
    for change in _CHANGES:
        pairs = []
        for view in tried:
            own = by_camera[view.camera_name]
            pairs.append((own[change.place(places[view.name], len(own))], view))
        ranks = in_parallel(partial(_rank, looks=change.looks), pairs)
        found = [rank for rank in ranks if rank is not None]
        if len(found) >= _FEW and np.mean(found) >= _FITS:
            return change.words
    return _displaced(tried)


def _rank(
    pair: tuple[CaptureView, CaptureView], looks: Callable[[Image], Image] = lambda image: image
) -> float | None:
    """Return the rank of the second view's mask in the image of the first; None if none is told."""
    shown, masked = pair
    try:
        image, mask = looks(shown.image()), masked.mask()
    except (ImageError, MaskError):
        return None
    return border_rank(image, mask) if image.shape[:2] == mask.shape else None


def _displaced(views: Sequence[CaptureView]) -> str | None:
    """Return by how much all masks are beside the object, if they are by the same."""
    told = in_parallel(_shift, views)
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


def _shift(view: CaptureView) -> tuple[float, float, float] | None:
    """Return the shift of a mask, and the object's size, in pixels of the recorded image."""
    try:
        found = fitting_shift(view.image(), view.mask())
    except (ImageError, MaskError):
        return None
    by = view.recorded.by
    return None if found is None else (found[0] * by, found[1] * by, found[2] * by)

"""Measures how much of a mask is grey, as of an alpha channel or of probabilities."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera.images import decode
from servoid.errors import MaskError

_NOISE = 8  # of 255; values beside a border that JPEG makes are mostly below
_MOST_GREY = 0.06  # JPEG at quality 50 leaves 0.04, a blur of 3 px or a fourfold enlargement 0.14
_MOST_WIDE_PX = 2.0  # a smoothed border has 0.5 to 1, whatever the size of the object
_LEAST_VALUES = 8  # different grey values; fewer are labels
_LEAST_RISE = 2.0  # from outside to inside: a border has 2.6 or more, a picture of the object 1


def grey_share(path: Path) -> float:
    """Return which share of a mask's non-zero pixels is more likely background, by their values.

    They count as the object, which they make too large. Borders that are only smooth have none, nor
    have labels and pictures of the object on black, whose values tell no probability.

    Raises:
        MaskError: the file is missing, cut short, or not an image.

    """
    import cv2

    pixels = decode(path, cv2.IMREAD_UNCHANGED, None, MaskError)
    colors = pixels if pixels.ndim == 2 else pixels[..., :3].max(axis=2)
    return _grey_share(np.asarray(colors))


def grey_note(share: float) -> str | None:
    """Report a mask of which a `share` is grey; None if that is little enough."""
    if share <= _MOST_GREY:
        return None
    return (
        f"{100.0 * share:.0f} % of the non-zero pixels are grey, a half of the largest value or "
        "less, and as every pixel that is not zero counts as the object, it is too large; "
        "threshold the mask at a half, such as with "
        "'magick IN.png -auto-level -threshold 50% OUT.png'"
    )


def _grey_share(values: NDArray[np.generic]) -> float:
    if values.dtype.kind not in "ui":
        return 0.0
    levels = values.astype(np.int64)
    largest = int(levels.max(initial=0))
    if largest > np.iinfo(np.uint8).max:  # of 16 bits
        levels, largest = levels >> 8, largest >> 8
    seen = levels > _NOISE
    is_grey = seen & (levels <= (largest + 1) // 2)
    if len(np.unique(levels[is_grey])) < _LEAST_VALUES or not _is_border(levels, seen, is_grey):
        return 0.0
    return float(is_grey.sum()) / max(1, int(np.count_nonzero(values)))


def _is_border(
    levels: NDArray[np.int64], seen: NDArray[np.bool_], is_grey: NDArray[np.bool_]
) -> bool:
    """Return whether grey pixels make a wide border, along which values rise to the inside."""
    import cv2

    if seen.all():
        return False  # nothing is outside
    depth_px = cv2.distanceTransform(seen.astype(np.uint8), cv2.DIST_L2, 5)
    outermost = np.count_nonzero(seen & (np.asarray(depth_px) < 1.5))
    if np.count_nonzero(is_grey) <= _MOST_WIDE_PX * outermost:
        return False
    depths, greys = np.asarray(depth_px)[is_grey], levels[is_grey]
    is_deep = depths > np.median(depths)
    if not is_deep.any():
        return False
    return bool(np.median(greys[is_deep]) >= _LEAST_RISE * np.median(greys[~is_deep]))

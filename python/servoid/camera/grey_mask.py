"""Measures how much of a mask is grey, as of an alpha channel or of probabilities."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera.images import decode
from servoid.errors import MaskError

_HALF = 128  # of 255: a pixel up to it is more likely background
_NOISE = 8  # of 255; values beside a border that JPEG makes are mostly below
_MOST_GREY = 0.06  # JPEG at quality 50 leaves 0.04, a blur of 3 px or a fourfold enlargement 0.14
_LEAST_VALUES = 8  # different grey values, if the mask has none above a half; one is a label


def grey_share(path: Path) -> float:
    """Return which share of a mask's non-zero pixels is more likely background, by their values.

    They count as the object, which they make too large. Masks with a single value, whatever it is,
    have none: they tell no probability.

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
        f"{100.0 * share:.0f} % of the non-zero pixels are grey, {_NOISE + 1} to {_HALF} of 255, "
        "and as every pixel that is not zero counts as the object, it is too large; threshold the "
        "mask at a half, such as with 'magick IN.png -threshold 50% OUT.png'"
    )


def _grey_share(values: NDArray[np.generic]) -> float:
    if values.dtype.kind not in "ui":
        return 0.0
    levels = values.astype(np.int64)
    largest = int(levels.max(initial=0))
    if largest > np.iinfo(np.uint8).max:  # of 16 bits
        levels, largest = levels >> 8, largest >> 8
    is_grey = (levels > _NOISE) & (levels <= _HALF)
    if largest <= _HALF and len(np.unique(levels[is_grey])) < _LEAST_VALUES:
        return 0.0
    return float(is_grey.sum()) / max(1, int(np.count_nonzero(values)))

"""Finds the hue window of the target, and the pixels with a hue in the window."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from servoid.errors import ImageError, MaskError
from servoid.pose import exact
from servoid.segment.target import HueTarget

if TYPE_CHECKING:
    FloatArray = NDArray[np.floating[Any]]

LEAST_SATURATION = HueTarget.least_saturation
LEAST_VALUE = HueTarget.least_value
"""Below these, of at most 1, a pixel is too grey or too dark for its hue to be meaningful."""

_SPREADS = 3.0
_LEAST_HALF_WIDTH_DEG = 8.0
_MOST_HALF_WIDTH_DEG = 60.0
_LEAST_SHARE = 0.5


def hue_window(image: NDArray[np.uint8], mask: NDArray[np.uint8]) -> tuple[float, float]:
    """Compute the window around the target's hue in an image, as (low, high) in degrees below 360.

    `image` is (H, W, 3) uint8 RGB; `mask` is (H, W) uint8, non-zero on the target. The window is
    centred on the circular mean of the hues of the target's coloured pixels. It extends by three
    circular standard deviations to both sides, but by at least 8 and at most 60 degrees. If low is
    above high, the window passes through 0, which is red.

    Raises:
        ImageError: the image is not an RGB image.
        MaskError: the mask is empty or not of the image's size, or most of the target is grey.

    """
    hue_deg, coloured = _hue_and_coloured(image, LEAST_SATURATION, LEAST_VALUE)
    if mask.shape != hue_deg.shape:
        raise MaskError(
            f"the mask has shape {mask.shape}, but its image {hue_deg.shape}; they must be equal"
        )
    target = mask != 0
    if not target.any():
        raise MaskError("the mask is empty: no pixel is non-zero; mark the target's pixels")
    share = float(coloured[target].mean())
    if share < _LEAST_SHARE:
        raise MaskError(
            f"only {share:.0%} of the target's pixels have a hue, the rest is grey or dark; a hue "
            f"window needs at least {_LEAST_SHARE:.0%}: mark this target with a mask"
        )
    return _window_around(hue_deg[target & coloured])


def match_image(
    image: NDArray[np.uint8],
    low_deg: float,
    high_deg: float,
    least_saturation: float = LEAST_SATURATION,
    least_value: float = LEAST_VALUE,
) -> NDArray[np.uint8]:
    """Return the pixels with hues in a window, (H, W) uint8: 255 where they are, else 0.

    `image` is (H, W, 3) uint8 RGB. The window goes from `low_deg` up to `high_deg`, both taken
    modulo 360 and inclusive, so (350, 10) passes through 0. Pixels with less than
    `least_saturation` or `least_value`, 0 to 1 each, do not match.

    Raises:
        ImageError: the image is not an RGB image, or a bound is out of its range.

    """
    bounds_deg = (low_deg, high_deg)
    if not np.isfinite(bounds_deg).all():
        raise ImageError(f"a hue window needs two finite numbers of degrees, not {bounds_deg}")
    for name, given in (("least_saturation", least_saturation), ("least_value", least_value)):
        if not 0.0 <= given <= 1.0:
            raise ImageError(f"{name} must be 0 to 1, but it is {given}")
    hue_deg, coloured = _hue_and_coloured(image, least_saturation, least_value)
    width = high_deg - low_deg if abs(high_deg - low_deg) >= 360 else (high_deg - low_deg) % 360
    inside = np.mod(hue_deg - low_deg, 360) <= abs(width)
    return np.where(inside & coloured, np.uint8(255), np.uint8(0))


def _hue_and_coloured(
    image: NDArray[np.uint8], least_saturation: float, least_value: float
) -> tuple["FloatArray", NDArray[np.bool_]]:
    """Return each pixel's hue in degrees, and whether its saturation and value suffice."""
    hue_deg, saturation, value = hue_planes(image)
    return hue_deg, (saturation >= least_saturation) & (value >= least_value)


def hue_planes(image: NDArray[np.uint8]) -> tuple["FloatArray", "FloatArray", "FloatArray"]:
    """Return each pixel's hue in degrees, and its saturation and value from 0 to 1.

    Raises:
        ImageError: the image is not an RGB image.

    """
    import cv2

    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8 or image.size == 0:
        raise ImageError(
            f"hue needs an (H, W, 3) uint8 RGB image, but this one is {image.shape} {image.dtype}"
        )
    shares = np.ascontiguousarray(image).astype(np.float32) / np.float32(255.0)
    planes = np.asarray(cv2.cvtColor(shares, cv2.COLOR_RGB2HSV), dtype=np.float32)
    return planes[..., 0], planes[..., 1], planes[..., 2]


def _window_around(hues_deg: "FloatArray") -> tuple[float, float]:
    hues = np.radians(hues_deg.astype(np.float64))
    x, y = float(exact.cos(hues).mean()), float(exact.sin(hues).mean())
    middle_deg = float(np.degrees(exact.arctan2(y, x)))
    length = min(max(exact.hypot(x, y), 1e-9), 1.0)
    # Source: Mardia, Jupp, *Directional Statistics* (2000), Sec. 2.3.
    spread_deg = float(np.degrees(np.sqrt(-2.0 * exact.log(length))))
    half_deg = min(max(_SPREADS * spread_deg, _LEAST_HALF_WIDTH_DEG), _MOST_HALF_WIDTH_DEG)
    return (middle_deg - half_deg) % 360.0, (middle_deg + half_deg) % 360.0

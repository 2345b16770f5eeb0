"""Encodes images for the page: the image itself, and an overlay of what was found."""

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError

_LONGEST_PX = 1600  # of an overlay, which the page stretches over its image
_JPEG_QUALITY = 92
_SHADE = (20, 16, 16, 175)  # BGRA, over everything outside the object
_BORDER = (40, 210, 255, 255)
_BORDER_SHARE = 1.0 / 400.0  # of the longest side


def encode_image(image: NDArray[np.uint8]) -> bytes:
    """Return an image (H, W, 3) uint8 RGB as the bytes of a JPEG file.

    Raises:
        OutputError: it cannot be encoded as JPEG.

    """
    return _encode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])


def draw_found(mask: NDArray[np.uint8]) -> bytes:
    """Return a PNG overlay: transparent on the object of a mask (H, W), dark elsewhere.

    Raises:
        OutputError: it cannot be encoded as PNG.

    """
    height, width = mask.shape
    scale = min(1.0, _LONGEST_PX / max(mask.shape))
    size = max(1, round(scale * width)), max(1, round(scale * height))
    inside = np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST), np.uint8)
    layer = np.zeros((size[1], size[0], 4), np.uint8)
    layer[inside == 0] = _SHADE
    outlines, _ = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    thick = max(1, round(_BORDER_SHARE * max(size)))
    cv2.drawContours(layer, outlines, -1, _BORDER, thick, cv2.LINE_AA)
    return _encode(".png", layer, [])


def _encode(kind: str, pixels: NDArray[np.uint8], options: list[int]) -> bytes:
    done, data = cv2.imencode(kind, np.ascontiguousarray(pixels), options)
    if not done:
        raise OutputError(f"an image of shape {pixels.shape} cannot be encoded as {kind}")
    return data.tobytes()

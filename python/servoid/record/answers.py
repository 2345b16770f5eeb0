"""Draws the candidates of an ambiguous target side by side, so that a person can choose."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError
from servoid.record.lettering import write_into

_TILE_PX = (360, 270)
_CAPTION_PX = 34
_GAP_PX = 8
_MARGIN = 0.25
_INK = (255, 255, 255)
_BORDER = (255, 210, 40)
_DIM = 0.35


def draw_answers(image: NDArray[np.uint8], masks: Sequence[NDArray[np.uint8]]) -> bytes:
    """Draw masks over their image, cut around them; return the PNG file's bytes.

    `image` is (H, W, 3) uint8 RGB, each mask (H, W) uint8, non-zero on the object. The first mask
    is labelled as the one that is used if the target is trusted.

    Raises:
        OutputError: the picture cannot be stored.

    """
    rows, columns = _window(masks)
    width, height = _TILE_PX
    pitch = width + _GAP_PX
    sheet = np.zeros((height + _CAPTION_PX, pitch * len(masks) - _GAP_PX, 3), np.uint8)
    for number, mask in enumerate(masks):
        left = number * pitch
        sheet[:height, left : left + width] = _tile(image[rows, columns], mask[rows, columns])
        words = "1: used if trusted" if number == 0 else f"{number + 1}"
        box = (left + 6, height, width - 12, _CAPTION_PX)
        write_into(sheet, box, words, _INK, size=0.55)
    done, data = cv2.imencode(".png", np.ascontiguousarray(sheet[..., ::-1]))
    if not done:
        raise OutputError("the picture of the candidates cannot be stored as PNG")
    return data.tobytes()


def _window(masks: Sequence[NDArray[np.uint8]]) -> tuple[slice, slice]:
    """Return the box around all masks, with the aspect ratio of a tile."""
    height, width = masks[0].shape
    taken = np.any([mask != 0 for mask in masks], axis=0)
    rows, columns = (np.flatnonzero(taken.any(axis=axis)) for axis in (1, 0))
    middle = (rows[0] + rows[-1]) / 2.0, (columns[0] + columns[-1]) / 2.0
    aspect = _TILE_PX[0] / _TILE_PX[1]
    tall = max(float(np.ptp(rows)), float(np.ptp(columns)) / aspect) * (0.5 + _MARGIN) + 4.0
    return (
        slice(max(0, round(middle[0] - tall)), min(height, round(middle[0] + tall) + 1)),
        slice(
            max(0, round(middle[1] - aspect * tall)),
            min(width, round(middle[1] + aspect * tall) + 1),
        ),
    )


def _tile(part: NDArray[np.uint8], mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Fit a part of an image into a tile, with everything but the object darkened."""
    tile = np.zeros((_TILE_PX[1], _TILE_PX[0], 3), np.uint8)
    height, width = part.shape[:2]
    scale = min(_TILE_PX[0] / width, _TILE_PX[1] / height)
    size = max(1, round(scale * width)), max(1, round(scale * height))
    seen = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_LINEAR), np.uint8)
    inside = np.asarray(cv2.resize(mask, size, interpolation=cv2.INTER_NEAREST), np.uint8)
    shown = np.where(inside[..., None] > 0, seen, (_DIM * seen).astype(np.uint8))
    outlines, _ = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    shown = np.ascontiguousarray(shown)
    cv2.drawContours(shown, outlines, -1, _BORDER, 1, cv2.LINE_AA)
    left, top = (_TILE_PX[0] - size[0]) // 2, (_TILE_PX[1] - size[1]) // 2
    tile[top : top + size[1], left : left + size[0]] = shown
    return tile

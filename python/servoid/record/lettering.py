"""Draws text into images, as large as fits."""

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.record.outline import Color

Box = tuple[int, int, int, int]  # left, top, width, height

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LEAST_SIZE = 0.36
_SMALLER = 0.03
_LINE_PX = 34.0  # height of a line of size 1
_BASE_PX = 11.0  # from the middle of a line of size 1 to its base line
_DARK = (0, 0, 0)
_LEFT_OUT = "..."


def width_px(words: str, size: float) -> int:
    """Return the width of a text in an image; size 1 is about 22 pixels high."""
    return cv2.getTextSize(words, _FONT, size, 1)[0][0]


def write(
    image: NDArray[np.uint8],
    at: tuple[int, int],
    words: str,
    color: Color,
    *,
    size: float = 0.45,
    shadow: bool = False,
) -> int:
    """Draw a text on a base line from the left, and return where it ends."""
    if shadow:
        cv2.putText(image, words, at, _FONT, size, _DARK, 3, cv2.LINE_AA)
    cv2.putText(image, words, at, _FONT, size, color, 1, cv2.LINE_AA)
    return at[0] + width_px(words, size)


def write_into(
    image: NDArray[np.uint8], box: Box, words: str, color: Color, *, size: float
) -> None:
    """Draw a text into a box, vertically centred; a long one is smaller and in several lines.

    A text that does not fit even in the smallest size is shortened with dots.
    """
    left, top, width, height = box
    size, lines = _fitted(words, (width, height), size)
    step = _LINE_PX * size
    middle = top + 0.5 * (height - step * (len(lines) - 1))
    for number, line in enumerate(lines):
        base = round(middle + number * step + _BASE_PX * size)
        write(image, (left, base), line, color, size=size)


def fill(image: NDArray[np.uint8], box: Box, color: Color) -> None:
    """Fill a box with a colour."""
    left, top, width, height = box
    image[top : top + height, left : left + width] = color


def _fitted(words: str, room_px: tuple[int, int], size: float) -> tuple[float, list[str]]:
    """Return the largest size at which a text fits into a box, and its lines."""
    while True:
        lines = _wrapped(words, room_px[0], size)
        most = max(1, int(room_px[1] / (_LINE_PX * size)))
        if len(lines) <= most and all(width_px(line, size) <= room_px[0] for line in lines):
            return size, lines
        if size - _SMALLER < _LEAST_SIZE:
            return size, _shortened(lines, most, room_px[0], size)
        size -= _SMALLER


def _wrapped(words: str, room_px: int, size: float) -> list[str]:
    """Break a text at its spaces into lines of a width."""
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if lines[-1] and width_px(longer, size) > room_px:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _shortened(lines: list[str], most: int, room_px: int, size: float) -> list[str]:
    """Return the first lines, with dots in place of text that does not fit."""
    kept = lines[:most]
    for place, line in enumerate(kept):
        gone = place == most - 1 and len(lines) > most
        while line and (gone or width_px(line, size) > room_px):
            line = line.removesuffix(_LEFT_OUT)[:-1].rstrip() + _LEFT_OUT
            gone = width_px(line, size) > room_px
            kept[place] = line
    return kept

"""The question on the page, and the answers to what the user marks."""

import base64
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.brief import brief
from servoid.errors import OutputError, ServoidError, TargetError
from servoid.segment import BoxTarget, ClickTarget, Found, parse_target

Mark = BoxTarget | ClickTarget


_LONGEST_PX = 1600  # of an overlay, which the page stretches over its image
_JPEG_QUALITY = 92
_SHADE = (20, 16, 16, 175)  # BGRA, over everything outside the object
_BORDER = (40, 210, 255, 255)
_BORDER_SHARE = 1.0 / 400.0  # of the longest side


@dataclass(frozen=True, eq=False)
class Choice:
    """The user's choice: a box or a click with the name of its view, and what it finds."""

    target: Mark
    found: Found

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Question:
    """An image in which the user marks the object.

    `view` is its name, such as `eye/0003`; `image` is (H, W, 3) uint8 RGB as recorded, and `seek`
    finds the object that a target means in it.
    """

    view: str
    image: NDArray[np.uint8]
    seek: Callable[[Mark], Found]

    __repr__ = brief


class Asking:
    """Answers the page: sends the image, reports what a mark finds, and accepts the choice."""

    def __init__(self, question: Question) -> None:
        self.question = question
        self.image: bytes = _encode_image(question.image)
        self._one_at_a_time = threading.Lock()
        self._last: Choice | None = None

    def seek(self, text: str) -> dict[str, Any]:
        """Return what a mark finds, in the form that the page shows.

        Raises:
            TargetError: the text is neither a box nor a click, or nothing is found.

        """
        found = self._segmented(text).found
        share = 100.0 * float((found.mask != 0).mean())
        return {
            "overlay": base64.b64encode(_draw_found(found.mask)).decode(),
            "words": f"The bright area is taken as the object: {share:.2g} % of the image.",
            "doubt": found.doubt,
            "notes": list(found.notes),
        }

    def choose(self, text: str) -> Choice:
        """Return a mark as the choice, with what it finds; errors as for `seek`."""
        return self._segmented(text)

    def _segmented(self, text: str) -> Choice:
        mark = replace(read_mark(text), view=self.question.view)
        with self._one_at_a_time:
            if self._last is None or self._last.target != mark:
                self._last = Choice(mark, self.question.seek(mark))
            return self._last


def read_mark(text: str) -> Mark:
    """Convert `box:U0,V0,U1,V1` or `click:U,V` to a target.

    Raises:
        TargetError: it is neither, or it names a view: the page shows one image only.

    """
    words = "write box:LEFT,TOP,RIGHT,BOTTOM or click:ACROSS,DOWN, in pixels"
    if not text.startswith(("box:", "click:")):
        raise TargetError(f"'{text[:40]}' is neither a box nor a click; {words}")
    try:
        target = parse_target(text)
    except ServoidError as error:
        raise TargetError(f"{error}; {words}") from error
    if not isinstance(target, Mark) or target.view is not None:
        raise TargetError(
            f"'{text[:40]}' names a view, but the page shows only this image; {words}"
        )
    return target


def _encode_image(image: NDArray[np.uint8]) -> bytes:
    """Return an image (H, W, 3) uint8 RGB as the bytes of a JPEG file.

    Raises:
        OutputError: it cannot be encoded as JPEG.

    """
    return _encode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])


def _draw_found(mask: NDArray[np.uint8]) -> bytes:
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

"""The question on the page, and the answers to what the user marks."""

import base64
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.errors import ServoidError, TargetError
from servoid.pick.overlay import draw_found, encode_image
from servoid.segment import BoxTarget, ClickTarget, Found, parse_target

Mark = BoxTarget | ClickTarget


@dataclass(frozen=True, eq=False)
class Choice:
    """The user's choice: a box or a click with the name of its view, and what it finds."""

    target: Mark
    found: Found


@dataclass(frozen=True, eq=False)
class Question:
    """An image in which the user marks the object.

    `view` is its name, such as `eye/0003`; `image` is (H, W, 3) uint8 RGB as recorded, and `seek`
    finds the object that a target means in it.
    """

    view: str
    image: NDArray[np.uint8]
    seek: Callable[[Mark], Found]


class Asking:
    """Answers the page: sends the image, reports what a mark finds, and accepts the choice."""

    def __init__(self, question: Question) -> None:
        self.question = question
        self.image: bytes = encode_image(question.image)
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
            "overlay": base64.b64encode(draw_found(found.mask)).decode(),
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

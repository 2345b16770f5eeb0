"""Composes raster pictures and text on a page."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError

PAPER = (255, 255, 255)
INK = "#222222"
QUIET_INK = "#666666"
WARNING_INK = "#c62f2f"

_DOTS_PER_INCH = 100


@dataclass(frozen=True)
class Text:
    """A line of text; (x_px, y_px) from the page's top left is its anchor on the base line."""

    x_px: float
    y_px: float
    words: str
    size_px: float = 20.0
    color: str = INK
    align: Literal["left", "center", "right"] = "left"
    bold: bool = False


@dataclass
class Page:
    """A white page of a size in pixels, with pictures and texts on it."""

    width_px: int
    height_px: int
    texts: list[Text] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.pixels: NDArray[np.uint8] = np.full(
            (self.height_px, self.width_px, 3), PAPER, np.uint8
        )

    def put(self, picture: NDArray[np.uint8], x_px: int, y_px: int) -> None:
        """Copy a picture (H, W, 3) RGB to the position of its top left pixel."""
        height, width = picture.shape[:2]
        self.pixels[y_px : y_px + height, x_px : x_px + width] = picture

    def png(self) -> bytes:
        """Return the page with its texts as the bytes of a PNG file."""
        import cv2

        image = _composite(self.pixels, self._set_texts())
        done, data = cv2.imencode(".png", image[:, :, ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 4])
        if not done:
            raise OutputError(f"cannot encode a picture of {self.width_px} x {self.height_px} px")
        return data.tobytes()

    def _set_texts(self) -> NDArray[np.uint8]:
        """Return the texts alone, (H, W, 4) RGBA, on a transparent page."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        size = (self.width_px / _DOTS_PER_INCH, self.height_px / _DOTS_PER_INCH)
        figure = Figure(figsize=size, dpi=_DOTS_PER_INCH, facecolor="none")
        canvas = FigureCanvasAgg(figure)
        for text in self.texts:
            figure.text(
                text.x_px / self.width_px,
                1.0 - text.y_px / self.height_px,
                text.words,
                fontsize=text.size_px * 72.0 / _DOTS_PER_INCH,
                color=text.color,
                ha=text.align,
                va="baseline",
                weight="bold" if text.bold else "normal",
                parse_math=False,  # a file's name may hold any character
            )
        canvas.draw()
        return np.asarray(canvas.buffer_rgba(), np.uint8)


def _composite(paper: NDArray[np.uint8], ink: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return paper (H, W, 3) with ink (H, W, 4) blended over it."""
    composed = paper.copy()
    rows, columns = np.nonzero(ink[:, :, 3])
    share = ink[rows, columns, 3:].astype(np.float32) / 255.0
    mixed = share * ink[rows, columns, :3] + (1.0 - share) * paper[rows, columns]
    composed[rows, columns] = np.rint(mixed).astype(np.uint8)
    return composed

"""Images and depth images in a bag, each read on request."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Picture, to_metres
from servoid.errors import CaptureError, ImageError
from servoid.exchange.bags.stored.header import NS_PER_S
from servoid.exchange.bags.stored.pixels import colors_of, depth_of, largest_color
from servoid.exchange.bags.stored.reader import Message, Stored, open_files


@dataclass(frozen=True)
class BagPicture(Picture):
    """One image in a bag; `at` is its position."""

    at: Stored = field(kw_only=True)

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
        """Read the image of (width, height) pixels: (H, W, 3) uint8, RGB, shrunk `by` a factor.

        Raises:
            ImageError: the bag is damaged, or the image has another size or encoding.

        """
        place = name_of(self.path, self.at)
        try:
            return open_files(self.path).decode(
                self.message(),
                lambda image: colors_of(image, size_px, place, by, bits=self.bits),
            )
        except CaptureError as error:
            raise ImageError(str(error)) from error

    def largest_value(self) -> int | None:
        """Read the image and return its largest value if it has 16 bits; None if it has others.

        Raises:
            ImageError: the bag is damaged.

        """
        place = name_of(self.path, self.at)
        try:
            return open_files(self.path).decode(
                self.message(), lambda image: largest_color(image, place)
            )
        except CaptureError as error:
            raise ImageError(str(error)) from error

    def message(self) -> Message:
        """Return the image as it was recorded.

        Raises:
            CaptureError: the bag is damaged.

        """
        return open_files(self.path).read(self.at)


@dataclass(frozen=True)
class BagDepth:
    """One depth image in a bag; `at` is its position."""

    path: Path
    at: Stored

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.float32]:
        """Read the depth image of (width, height) pixels, shrunk `by` a factor.

        Returns (H, W) float32, metres along z, NaN where unknown.

        Raises:
            ImageError: the bag is damaged, or the image has another size or encoding.

        """
        place = name_of(self.path, self.at)
        try:
            bag = open_files(self.path)
            values, scale_m = bag.decode(
                bag.read(self.at), lambda image: depth_of(image, self.at.topic, size_px, place)
            )
        except CaptureError as error:
            raise ImageError(str(error)) from error
        return to_metres(values, scale_m, by)


def name_of(path: Path, at: Stored) -> str:
    """Return the name of a message for users: the bag, the topic, and the recording time."""
    return f"{path}, {at.topic} of {at.log_ns / NS_PER_S:.3f} s"

"""One image on disk, in a file of its own or inside a video."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera.bit_depth import WHOLE_BITS
from servoid.camera.images import largest_value, read_image
from servoid.camera.video import read_video_image


@dataclass(frozen=True)
class Picture:
    """One image on disk; `index` counts from 0 inside a video and is None for an image file.

    `label` names the image where the file name does not identify it. With `upright` the orientation
    that the file states is applied; without, only where no other orientation has the camera's size.
    `bits` is how many of 16 bits the values of a 16-bit image have.
    """

    path: Path
    index: int | None = None
    label: str | None = None
    upright: bool = False
    bits: int = WHOLE_BITS

    @property
    def stem(self) -> str:
        """Return the name without a suffix, as the mask is named: `0012` is image 12 of a video."""
        if self.label is not None:
            return self.label
        return self.path.stem if self.index is None else f"{self.index:04}"

    @property
    def is_there(self) -> bool:
        """Return whether there is an image; only a view in memory can lack one."""
        return True

    @property
    def is_in_memory(self) -> bool:
        """Return whether the pixels are in memory, so that nothing is read."""
        return False

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
        """Read the image of (width, height) pixels: (H, W, 3) uint8, RGB, shrunk `by` a factor.

        Raises:
            ImageError: the file is missing, damaged or of another size.

        """
        if self.index is None:
            return read_image(self.path, size_px, by, upright=self.upright, bits=self.bits)
        return read_video_image(self.path, self.index, size_px, by, upright=self.upright)

    def largest_value(self) -> int | None:
        """Read the image and return its largest value if it has 16 bits; None if it has others.

        Raises:
            ImageError: the file is missing or damaged.

        """
        return None if self.index is not None else largest_value(self.path)

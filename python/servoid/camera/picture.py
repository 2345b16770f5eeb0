"""One image on disk, in a file of its own or inside a video."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera.images import read_image
from servoid.camera.video import read_video_image


@dataclass(frozen=True)
class Picture:
    """One image on disk; `index` counts from 0 inside a video and is None for an image file.

    `label` names the image where the name of its file does not tell it from others. With `upright`
    it is turned as its file asks for, else only where it has its camera's size in no other way.
    """

    path: Path
    index: int | None = None
    label: str | None = None
    upright: bool = False

    @property
    def stem(self) -> str:
        """Name the image without a suffix, as its mask is named: `0012` is image 12 of a video."""
        if self.label is not None:
            return self.label
        return self.path.stem if self.index is None else f"{self.index:04}"

    @property
    def is_there(self) -> bool:
        """Say if there is an image at all, which only one in memory can lack."""
        return True

    @property
    def is_in_memory(self) -> bool:
        """Say if the image is held already, so that nothing is read."""
        return False

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
        """Read the image of (width, height) pixels: (H, W, 3) uint8, RGB, shrunk `by` so much.

        Raises:
            ImageError: the file is missing, damaged or of another size.

        """
        if self.index is None:
            return read_image(self.path, size_px, by, upright=self.upright)
        return read_video_image(self.path, self.index, size_px, by, upright=self.upright)

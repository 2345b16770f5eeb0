"""The ideal pinhole camera that stands for a lens: its maps are made once and shared."""

from functools import cached_property, lru_cache
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose
from servoid.camera.images import Recorded, read_mask
from servoid.camera.undistort import Undistortion, undistortion
from servoid.errors import located

_KEPT = 8  # a map of a large image takes hundreds of megabytes


class Ideal:
    """The pinhole camera that sees what a lens saw, without its distortion.

    Views that share an `Ideal` share its maps. A fisheye lens sees more than a pinhole can, so its
    pinhole looks at the object: `mask` says where that is, a file or (H, W) in the lens's pixels.
    """

    def __init__(
        self,
        lens: Lens,
        mask: Path | NDArray[np.uint8] | None = None,
        recorded: Recorded | None = None,
    ) -> None:
        """Stand for a lens; `recorded` is how a mask's file is read, if not as the lens sees."""
        self.lens = lens
        self._recorded = recorded or Recorded(lens.size_px)
        self._mask = mask if needs_object(lens) else None
        self._lock = Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """Say how to make a copy: its maps are made anew, and a lock cannot be copied."""
        return Ideal, (self.lens, self._mask, self._recorded)

    @cached_property
    def camera(self) -> Camera:
        """Return the pinhole camera."""
        return self.maps().camera

    @cached_property
    def lens_from_camera(self) -> Pose:
        """Return how the pinhole camera is turned against the lens."""
        return self.maps().lens_from_camera

    def maps(self) -> Undistortion:
        """Return what turns images of the lens into images of the pinhole camera."""
        with self._lock:  # threads that ask at once wait for one answer
            return _maps(self)

    def _read(self, mask: Path) -> NDArray[np.uint8]:
        return read_mask(mask, self._recorded.size_px, self._recorded.by)

    def _undistortion(self) -> Undistortion:
        if self._mask is None:
            return undistortion(self.lens)
        if isinstance(self._mask, Path):
            place, mask = str(self._mask), self._read(self._mask)
        else:
            place, mask = "the object", self._mask
        rows, columns = np.nonzero(mask)
        if len(rows) == 0:  # joining the view with an empty mask says what is wrong
            return undistortion(self.lens)
        with located(place):
            return undistortion(self.lens, np.stack([columns, rows], axis=1).astype(np.float64))


def needs_object(lens: Lens) -> bool:
    """Say if the pinhole camera of a lens depends on where the object is."""
    return lens.model == "kannala_brandt"


@lru_cache(maxsize=_KEPT)
def _maps(ideal: Ideal) -> Undistortion:
    return ideal._undistortion()

"""The undistorted pinhole camera of a lens: its pixel maps are computed once and shared."""

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


class IdealCamera:
    """The pinhole camera that sees what a lens saw, without its distortion.

    Views that share an `IdealCamera` share its maps. A fisheye lens sees more than a pinhole camera
    can, so its pinhole camera looks at the object: `mask` gives the object's pixels in the lens's
    image, as a file or as an array (H, W).
    """

    def __init__(
        self,
        lens: Lens,
        mask: Path | NDArray[np.uint8] | None = None,
        recorded: Recorded | None = None,
    ) -> None:
        """Take a lens; `recorded` is the size of a mask's file if it is not the lens's."""
        self.lens = lens
        self._recorded = recorded or Recorded(lens.size_px)
        self._mask = mask if needs_object(lens) else None
        self._lock = Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle only the inputs: the copy computes its maps again and has its own lock."""
        return IdealCamera, (self.lens, self._mask, self._recorded)

    @cached_property
    def camera(self) -> Camera:
        """Return the pinhole camera."""
        return self.maps().camera

    @cached_property
    def lens_from_camera(self) -> Pose:
        """Return the rotation of the pinhole camera relative to the lens."""
        return self.maps().lens_from_camera

    def maps(self) -> Undistortion:
        """Return the undistortion, which converts images of the lens to the pinhole camera."""
        with self._lock:  # threads that ask at the same time share one computation
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
        if len(rows) == 0:  # `CaptureView.view` reports the empty mask
            return undistortion(self.lens)
        with located(place):
            return undistortion(self.lens, np.stack([columns, rows], axis=1).astype(np.float64))


def needs_object(lens: Lens) -> bool:
    """Return whether the pinhole camera of a lens depends on where the object is."""
    return lens.model == "kannala_brandt"


@lru_cache(maxsize=_KEPT)
def _maps(ideal: IdealCamera) -> Undistortion:
    return ideal._undistortion()

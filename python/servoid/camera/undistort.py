"""Undistorts images: in an ideal pinhole camera, an ellipsoid's outline is an ellipse."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose
from servoid.brief import brief
from servoid.camera.ideal_camera import camera_along_the_axis, camera_towards, sees
from servoid.camera.images import Recorded, read_mask
from servoid.errors import ImageError, MaskError, ServoidError, located
from servoid.pose import exact

_LEAST_DEPTH = 1e-6  # Of a direction of length 1: below it, the ray does not point forward.


_KEPT = 8  # a map of a large image takes hundreds of megabytes


@dataclass(frozen=True)
class Undistortion:
    """Converts images of a lens to an ideal pinhole camera; computed once for each lens.

    `map_px`, (H, W, 2) float32, is the position in the lens's image of each pixel of the ideal
    image. It is None where the lens is a pinhole already: images then pass unchanged. Pixels that
    the lens does not see are 0 in every result.
    """

    camera: Camera
    lens_from_camera: Pose
    map_px: NDArray[np.float32] | None
    lens: Lens

    __repr__ = brief

    def image(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the undistorted image, (H, W) or (H, W, 3) uint8, interpolated bilinearly.

        Raises:
            ImageError: the image has not the lens's size.

        """
        self._check(image, "the image", ImageError, dimensions=3)
        return np.asarray(self._remapped(image, smooth=True), dtype=np.uint8)

    def mask(self, mask: NDArray[np.uint8] | NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Return the undistorted mask, (H, W): 255 where the nearest pixel is not zero.

        Raises:
            MaskError: the mask has not the lens's size.

        """
        self._check(mask, "the mask", MaskError)
        full = (mask != 0).astype(np.uint8) * np.uint8(255)
        return np.asarray(self._remapped(full), dtype=np.uint8)

    def depth(self, depth: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the undistorted depth image, (H, W) float, in metres.

        Depth along the lens's axis is converted to depth along the ideal camera's axis, for the
        point that the nearest pixel measured. Unknown depths, 0 or NaN, stay unknown. Points beside
        or behind the lens have no depth.

        Raises:
            ImageError: the depth image has not the lens's size.

        """
        self._check(depth, "the depth image", ImageError)
        known = depth if depth.dtype in (np.float32, np.float64) else depth.astype(np.float32)
        made = self._remapped(known)
        with np.errstate(invalid="ignore"):
            return made if self._turn is None else (made * self._turn).astype(known.dtype)

    def _remapped(self, pixels: NDArray[Any], smooth: bool = False) -> NDArray[Any]:
        if self.map_px is None:
            return pixels
        import cv2  # takes as long to import as the rest of the package; help texts do not need it

        how = cv2.INTER_LINEAR if smooth else cv2.INTER_NEAREST
        return np.asarray(cv2.remap(pixels, self.map_px, np.empty(0), how))

    @cached_property
    def _turn(self) -> NDArray[np.float64] | None:
        """Depth along the camera's axis per depth along the lens's; None if the axes are equal."""
        if self.map_px is None or self.lens_from_camera.matrix()[2, 2] >= 1.0:
            return None
        read_px = np.rint(self.map_px.astype(np.float64)).reshape(-1, 2)
        rays = self.lens.rays(read_px)
        depth_in_camera = exact.product(rays, self.lens_from_camera.matrix()[:3, 2])
        known = rays[:, 2] > _LEAST_DEPTH
        share = np.where(known, depth_in_camera / np.where(known, rays[:, 2], 1.0), 0.0)
        return share.reshape(self.map_px.shape[:2])

    def _check(
        self, pixels: NDArray[Any], what: str, error: type[ServoidError], dimensions: int = 2
    ) -> None:
        width, height = self.lens.size_px
        if pixels.ndim > dimensions:
            raise error(f"{what} must have shape (H, W), but it is {pixels.shape}")
        if pixels.shape[:2] != (height, width):
            given = "x".join(str(side) for side in pixels.shape[1::-1])
            raise error(
                f"{what} is {given} pixels, but the lens has {width}x{height}; give images of "
                "the size that the lens was calibrated for"
            )


def undistortion(lens: Lens, object_px: NDArray[np.float64] | None = None) -> Undistortion:
    """Compute the ideal pinhole camera of a lens, and the map from its pixels to the lens's.

    A pinhole, or a lens whose coefficients are all zero, needs no map. Otherwise the ideal camera
    looks along the lens's axis with the lens's focal length. Its image is large enough for all that
    the lens sees, within these limits: at most 60 degrees to each side, above and below, at most
    twice the longer side of the lens's image and at most `Camera.MAX_SIDE_PX`. The rest is cut off
    at the edges.

    `object_px`, (N, 2), are pixels (u, v) of the object in the lens's image, such as those of a
    mask. With them, the ideal camera of a Kannala-Brandt lens points at the object's centre,
    wherever the lens sees it. It has the lens's angular resolution there, and its image contains
    the object with a margin. For a Brown-Conrady lens this happens only where the camera along the
    axis would cut the object off; otherwise the camera is the same for every object.

    Raises:
        CameraError: the lens sees nothing inside its image or at the object, or the object spans
            more than 120 degrees.

    """
    if lens.model == "pinhole" or (lens.model == "brown_conrady" and not any(lens.distortion)):
        camera = Camera(size_px=lens.size_px, focal_px=lens.focal_px, center_px=lens.center_px)
        return Undistortion(camera, Pose.identity(), None, lens)
    if object_px is None:
        return _undistortion(lens, camera_along_the_axis(lens), Pose.identity())
    pixels = np.ascontiguousarray(object_px, dtype=np.float64)
    if lens.model == "brown_conrady":
        camera = camera_along_the_axis(lens)
        if sees(camera, lens, pixels):
            return _undistortion(lens, camera, Pose.identity())
    return _undistortion(lens, *camera_towards(lens, pixels))


def _undistortion(lens: Lens, camera: Camera, lens_from_camera: Pose) -> Undistortion:
    map_px = lens.map_to(camera, lens_from_camera)
    map_px.setflags(write=False)
    return Undistortion(camera, lens_from_camera, map_px, lens)


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

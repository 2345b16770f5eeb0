"""Captures: a folder of images with the cameras that took them and the cameras' poses."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose, View
from servoid.brief import brief, said
from servoid.camera import (
    IdealCamera,
    Picture,
    Recorded,
    StoredDepth,
    needs_object,
    read_depth,
    read_mask,
)
from servoid.errors import CaptureError, MaskError, located
from servoid.words import counted, joined


def read_scaled(
    path: Path | StoredDepth, recorded: Recorded, scale_m: float | None
) -> NDArray[np.float32]:
    """Read a depth image whose unit is `scale_m` metres: (H, W) float32, NaN where unknown.

    Raises:
        ImageError: the file is missing, damaged or not of the recorded size.
        CaptureError: the unit of the file's values is unknown.

    """
    if not isinstance(path, Path):
        return path.read(recorded.size_px, recorded.by)
    if scale_m is None:
        raise CaptureError(
            f"{path}: the unit of its values is unknown; give depth_scale_m, such as 0.001 "
            "for millimetres"
        )
    return read_depth(path, recorded.size_px, scale_m, recorded.by)


@dataclass(frozen=True)
class CaptureCamera:
    """One camera of the rig and its images in each observation, in order.

    An entry of `pictures`, of the masks or of the depth images is None where the camera delivered
    none. `depth_scale_m` is one unit of the depth images in metres. `masks`, (H, W) uint8, and
    `depths_m`, (H, W) float32 in metres, are in memory and replace the files. `absences` give the
    reason where a picture is None, if one is known.
    """

    name: str
    lens: Lens
    rig_from_camera: Pose
    pictures: tuple[Picture | None, ...]
    mask_paths: tuple[Path | None, ...]
    depth_paths: tuple[Path | StoredDepth | None, ...]
    depth_scale_m: float | None = None
    masks: tuple[NDArray[np.uint8] | None, ...] = ()
    depths_m: tuple[NDArray[np.float32] | None, ...] = ()
    absences: tuple[str | None, ...] = ()

    def __repr__(self) -> str:
        width, height = self.lens.size_px
        there = sum(picture is not None for picture in self.pictures)
        return said(CaptureCamera, self.name, f"{width}x{height} pixels", counted(there, "image"))

    def recorded_depth(self, index: int) -> NDArray[np.float32] | None:
        """Read a depth image in the pixels of the recorded image: metres, NaN where unknown.

        Raises:
            ImageError: the file is missing, damaged or of another size than the camera's.
            CaptureError: the unit of the file's values is unknown.

        """
        if self.depths_m:
            return self.depths_m[index]
        path = self.depth_paths[index]
        return (
            None
            if path is None
            else read_scaled(path, Recorded(self.lens.size_px), self.depth_scale_m)
        )

    @cached_property
    def ideal(self) -> IdealCamera:
        """Return the undistorted pinhole camera that applies where no object is known."""
        return IdealCamera(self.lens)


@dataclass(frozen=True)
class Observation:
    """What all cameras deliver at one instant: the time, the rig's pose, an image per camera."""

    index: int
    time_s: float | None
    world_from_rig: Pose
    pictures: tuple[Picture | None, ...]

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class CaptureView:
    """One image of a camera with a known pose, as an ideal pinhole camera would see it.

    `lens` and `world_from_lens` describe the real camera, as stored in the files. `camera`,
    `world_from_camera` and the results of all methods refer to the ideal pinhole camera: without
    distortion, and pointed at the object if the lens is a fisheye.

    `given_mask`, (H, W) uint8, is a mask in the ideal pinhole's pixels; it takes precedence over
    the others. `recorded_mask`, (H, W) uint8, is a mask in the pixels of the recorded image; it
    replaces the file. `depth_m`, (H, W) float32 in metres, likewise replaces the depth file.
    `shrinking` is the size of the images in the files where they are shrunk to the lens's size.
    `is_metric` is False if lengths are in an unknown unit, that of the capture.
    """

    camera_name: str
    index: int
    picture: Picture
    mask_path: Path | None
    depth_path: Path | StoredDepth | None
    lens: Lens
    world_from_lens: Pose
    depth_scale_m: float | None = None
    given_mask: NDArray[np.uint8] | None = None
    recorded_mask: NDArray[np.uint8] | None = None
    shared: IdealCamera | None = None
    depth_m: NDArray[np.float32] | None = None
    shrinking: Recorded | None = None
    is_metric: bool = True

    def __repr__(self) -> str:
        width, height = self.lens.size_px
        has_depth = self.depth_m is not None or self.depth_path is not None
        return said(
            CaptureView,
            self.name,
            f"{width}x{height} pixels",
            "with mask" if self.has_mask else "without mask",
            "with depth" if has_depth else None,
        )

    @property
    def recorded(self) -> Recorded:
        """Return the size of the images in the files, and the factor by which they are shrunk."""
        return self.shrinking or Recorded(self.lens.size_px)

    @property
    def name(self) -> str:
        """Return the view's name for messages: the camera and the image, such as `eye/0012`."""
        return f"{self.camera_name}/{self.picture.stem}"

    @property
    def image_path(self) -> Path:
        """Return the file that holds the image."""
        return self.picture.path

    @property
    def has_image(self) -> bool:
        """Return whether there is an image; views made from arrays may have only a mask."""
        return self.picture.is_there

    @property
    def has_depth(self) -> bool:
        """Return whether there is a depth image, in a file or in memory."""
        return self.depth_path is not None or self.depth_m is not None

    @property
    def has_mask(self) -> bool:
        """Return whether there is a mask, in a file or in memory."""
        return any(one is not None for one in (self.given_mask, self.recorded_mask, self.mask_path))

    @cached_property
    def ideal(self) -> IdealCamera:
        """Return the ideal pinhole camera, with the maps that undistort the lens's images."""
        mask = self.mask_path if self.recorded_mask is None else self.recorded_mask
        return self.shared or IdealCamera(self.lens, mask, self.recorded)

    @cached_property
    def camera(self) -> Camera:
        """Return the ideal pinhole camera.

        Raises:
            CameraError: the lens sees nothing of its image, or the object is too wide.
            MaskError: the lens is a fisheye, and the mask that its pinhole is aimed at is damaged.

        """
        return self.ideal.camera

    @cached_property
    def world_from_camera(self) -> Pose:
        """Return the pose of the ideal pinhole camera; errors as for `camera`."""
        return self.world_from_lens @ self.ideal.lens_from_camera

    def with_mask(self, mask: NDArray[np.uint8]) -> "CaptureView":
        """Return this view with a mask in its ideal pinhole's pixels: non-zero on the object.

        The new view keeps this view's pinhole camera.

        Raises:
            MaskError: the mask is not (H, W) of the pinhole camera's size.

        """
        width, height = self.camera.size_px
        if mask.shape != (height, width):
            raise MaskError(
                f"{self.name}: the mask has shape {mask.shape}; the camera needs {(height, width)}"
            )
        given = (mask != 0).astype(np.uint8) * np.uint8(255)
        return replace(self, given_mask=given, shared=self.ideal)

    def with_recorded_mask(self, mask: NDArray[np.uint8]) -> "CaptureView":
        """Return this view with a mask in the recorded image's pixels: non-zero on the object.

        The pinhole camera of a fisheye is aimed at this mask, as at a mask in a file.

        Raises:
            MaskError: the mask is not (H, W) of the recorded image's size.

        """
        width, height = self.lens.size_px
        if mask.shape != (height, width):
            raise MaskError(
                f"{self.name}: the mask has shape {mask.shape}; the image has {(height, width)}"
            )
        recorded = (mask != 0).astype(np.uint8) * np.uint8(255)
        shared = None if needs_object(self.lens) else self.shared
        return replace(self, given_mask=None, recorded_mask=recorded, shared=shared)

    def recorded_image(self) -> NDArray[np.uint8]:
        """Read the image as it was recorded, with the lens's distortion: (H, W, 3) uint8, RGB.

        Raises:
            ImageError: as for `image`.

        """
        return self.picture.read(self.recorded.size_px, self.recorded.by)

    def image(self) -> NDArray[np.uint8]:
        """Read the image: (H, W, 3) uint8, RGB.

        Raises:
            ImageError: the file is missing, damaged or of another size than the camera's.

        """
        return self.ideal.maps().image(self.recorded_image())

    def mask(self) -> NDArray[np.uint8]:
        """Read the mask: (H, W) uint8, 255 on the object and 0 elsewhere.

        Raises:
            MaskError: there is no mask, or its file is missing, damaged or of another size than
                the camera's.
            ImageError: the file cannot be used, and nor can that of the image.

        """
        if self.given_mask is not None:
            return self.given_mask
        if self.recorded_mask is not None:
            return self.ideal.maps().mask(self.recorded_mask)
        if self.mask_path is None:
            raise MaskError(f"{self.name} has no mask; write one and name it like the image")
        try:
            mask = read_mask(self.mask_path, self.recorded.size_px, self.recorded.by)
        except MaskError:
            if self.has_image:
                self.recorded_image()  # where that has another size too, size_px is wrong
            raise
        if not mask.any():
            width, height = self.recorded.size_px
            raise MaskError(
                f"{self.mask_path}: the mask is empty: no pixel of its {width}x{height} is "
                "non-zero; mark the object's pixels"
            )
        return self.ideal.maps().mask(mask)

    def depth(self) -> NDArray[np.float32] | None:
        """Read the depth image: (H, W) float32, metres along z, NaN where unknown; None if none.

        Raises:
            ImageError: the file is missing, damaged or of another size than the camera's.
            CaptureError: the unit of the file's values is unknown.

        """
        depth = self.recorded_depth()
        if depth is None:
            return None
        seen = self.ideal.maps().depth(depth).astype(np.float32)
        seen[seen == 0.0] = np.nan  # outside the lens's field of view
        return seen

    def recorded_depth(self) -> NDArray[np.float32] | None:
        """Read the depth image in the pixels of the recorded image; otherwise as `depth`.

        Raises:
            ImageError, CaptureError: as for `depth`.

        """
        if self.depth_m is not None:
            return self.depth_m
        if self.depth_path is None:
            return None
        return read_scaled(self.depth_path, self.recorded, self.depth_scale_m)

    def view(self, mask: NDArray[np.uint8] | None = None) -> View:
        """Combine the mask, which is read if it is not given, with the camera and its pose.

        Raises:
            MaskError: as for `mask`, or the mask is empty or covers the whole image.

        """
        mask = self.mask() if mask is None else mask
        is_in_memory = self.given_mask is not None or self.recorded_mask is not None
        with located(self.name if is_in_memory else str(self.mask_path)):
            return View(camera=self.camera, world_from_camera=self.world_from_camera, mask=mask)


@dataclass(frozen=True)
class Capture:
    """A validated capture: each camera has an image, or None, for each observation.

    `rate_hz` is the number of observations per second of a recording, `notes` are messages for the
    user. `metric` is false where the scale is unknown, `measured` where nobody calibrated.
    """

    path: Path
    cameras: tuple[CaptureCamera, ...]
    world_from_rig: tuple[Pose, ...]
    times_s: tuple[float, ...] | None
    rate_hz: float | None = None
    notes: tuple[str, ...] = ()
    metric: bool = True
    measured: bool = True

    def __repr__(self) -> str:
        return said(
            Capture,
            str(self.path),
            counted(len(self), "observation"),
            f"{counted(len(self.cameras), 'camera')}: "
            + joined([camera.name for camera in self.cameras]),
            None if self.rate_hz is None else f"{self.rate_hz:g} Hz",
            None if self.metric else "not in metres",
        )

    def __len__(self) -> int:
        return len(self.world_from_rig)

    @property
    def is_recording(self) -> bool:
        """Return whether the object may move between observations: the capture has a rate."""
        return self.rate_hz is not None

    def observations(self) -> list[Observation]:
        """List the observations in order; `time_s` is None where the capture has no times."""
        return [
            Observation(
                index=index,
                time_s=None if self.times_s is None else self.times_s[index],
                world_from_rig=pose,
                pictures=tuple(camera.pictures[index] for camera in self.cameras),
            )
            for index, pose in enumerate(self.world_from_rig)
        ]

    def views(self) -> list[CaptureView]:
        """List the images that have a mask: camera by camera, each in the order of its images."""
        return [view for view in self.all_views() if view.has_mask]

    def all_views(self) -> list[CaptureView]:
        """List all images: camera by camera, each in the order of its images."""
        return [
            self._view(camera, index, picture)
            for camera in self.cameras
            for index, picture in enumerate(camera.pictures)
            if picture is not None
        ]

    def _view(self, camera: CaptureCamera, index: int, picture: Picture) -> CaptureView:
        mask_path = camera.mask_paths[index]
        mask = camera.masks[index] if camera.masks else None
        own = (mask_path is not None or mask is not None) and needs_object(camera.lens)
        return CaptureView(
            camera_name=camera.name,
            index=index,
            picture=picture,
            mask_path=mask_path,
            depth_path=camera.depth_paths[index],
            lens=camera.lens,
            world_from_lens=self.world_from_rig[index] @ camera.rig_from_camera,
            depth_scale_m=camera.depth_scale_m,
            shared=None if own else camera.ideal,
            recorded_mask=mask,
            depth_m=camera.depths_m[index] if camera.depths_m else None,
            is_metric=self.metric,
        )

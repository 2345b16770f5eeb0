"""Captures: a folder of images with the cameras that took them and where these stood."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose, View
from servoid.errors import located
from servoid.observe.images import read_image, read_mask


@dataclass(frozen=True)
class CaptureCamera:
    """One camera of the rig, with its images in order and, where there is one, their masks."""

    name: str
    camera: Camera
    rig_from_camera: Pose
    image_paths: tuple[Path, ...]
    mask_paths: tuple[Path | None, ...]


@dataclass(frozen=True)
class Observation:
    """One instant of all cameras: when it was, where the rig was, and an image of each camera."""

    index: int
    time_s: float | None
    world_from_rig: Pose
    image_paths: tuple[Path, ...]


@dataclass(frozen=True)
class CaptureView:
    """One image with a mask, seen by a camera whose pose is known."""

    camera_name: str
    index: int
    image_path: Path
    mask_path: Path
    camera: Camera
    world_from_camera: Pose

    @property
    def name(self) -> str:
        """Name the view for people: the camera and the image, such as `eye/0012`."""
        return f"{self.camera_name}/{self.image_path.stem}"

    def image(self) -> NDArray[np.uint8]:
        """Read the image: (H, W, 3) uint8, RGB.

        Raises:
            ImageError: the file is missing, damaged or of another size than the camera's.

        """
        return read_image(self.image_path, self.camera.size_px)

    def mask(self) -> NDArray[np.uint8]:
        """Read the mask: (H, W) uint8, 255 on the object and 0 elsewhere.

        Raises:
            MaskError: the file is missing, damaged or of another size than the camera's.

        """
        return read_mask(self.mask_path, self.camera.size_px)

    def view(self) -> View:
        """Read the mask and join it with the camera and its pose, ready for modelling.

        Raises:
            MaskError: as for `mask`, or the mask is empty or covers the whole image.

        """
        mask = self.mask()
        with located(str(self.mask_path)):
            return View(camera=self.camera, world_from_camera=self.world_from_camera, mask=mask)


@dataclass(frozen=True)
class Capture:
    """A checked capture: every camera has one image for each observation."""

    path: Path
    cameras: tuple[CaptureCamera, ...]
    world_from_rig: tuple[Pose, ...]
    times_s: tuple[float, ...] | None

    def __len__(self) -> int:
        return len(self.world_from_rig)

    def observations(self) -> list[Observation]:
        """List the observations in order; `time_s` is None where the capture knows no time."""
        return [
            Observation(
                index=index,
                time_s=None if self.times_s is None else self.times_s[index],
                world_from_rig=pose,
                image_paths=tuple(camera.image_paths[index] for camera in self.cameras),
            )
            for index, pose in enumerate(self.world_from_rig)
        ]

    def views(self) -> list[CaptureView]:
        """List the images that have a mask: camera by camera, each in the order of its images."""
        return [
            CaptureView(
                camera_name=camera.name,
                index=index,
                image_path=image_path,
                mask_path=mask_path,
                camera=camera.camera,
                world_from_camera=self.world_from_rig[index] @ camera.rig_from_camera,
            )
            for camera in self.cameras
            for index, (image_path, mask_path) in enumerate(
                zip(camera.image_paths, camera.mask_paths, strict=True)
            )
            if mask_path is not None
        ]

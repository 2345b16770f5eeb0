"""Observations as lenses recorded them, before they are undistorted."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.brief import brief
from servoid.camera import IdealCamera
from servoid.capture import ArrayPicture, Capture, CaptureCamera
from servoid.source.instants import ideal_image
from servoid.source.source import Instant


@dataclass(frozen=True)
class MountedCamera:
    """One camera of a rig: its name, its lens and its pose on the rig."""

    name: str
    lens: Lens
    rig_from_camera: Pose


@dataclass(frozen=True, eq=False)
class RawImage:
    """One image as its lens recorded it: (H, W, 3) uint8 RGB, and its capture time in seconds.

    `number` counts the images of its camera that arrived, from 1. `depth_m` (H, W) float32 is in
    metres along z in the same pixels, NaN where unknown. `encoded` is the JPEG file with these
    pixels, if the image arrived as one.
    """

    pixels: NDArray[np.uint8]
    time_s: float
    number: int
    depth_m: NDArray[np.float32] | None = None
    encoded: bytes | None = None

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class RawInstant:
    """One observation as the lenses recorded it.

    `images` are None where a camera delivered nothing usable; `notices` give the reasons. `index`
    counts the observations that arrived, including those that nobody requested in time.
    """

    index: int
    time_s: float
    images: tuple[RawImage | None, ...]
    world_from_lens: tuple[Pose, ...]
    notices: tuple[str, ...] = ()

    __repr__ = brief

    @property
    def is_dark(self) -> bool:
        """Return whether no camera delivered an image."""
        return all(image is None for image in self.images)


@runtime_checkable
class RawSource(Protocol):
    """Delivers observations as they arrive, as the lenses recorded them."""

    @property
    def rig(self) -> tuple[MountedCamera, ...]:
        """Return the cameras whose images are delivered."""
        ...

    def newest_raw(self) -> RawInstant | None:
        """Return the newest observation that has arrived and was not yet returned, else None.

        Older ones that were not requested are dropped.
        """
        ...

    def silence(self) -> str | None:
        """Return why no image comes, if none has come for a while; else None."""
        ...


def instant_of(
    raw: RawInstant, rig: Sequence[MountedCamera], ideals: Sequence[IdealCamera]
) -> Instant:
    """Return an observation as the ideal pinholes of the rig's cameras see it."""
    seen = [
        (None, None) if image is None else ideal_image(camera.name, ideal, image.pixels)
        for camera, ideal, image in zip(rig, ideals, raw.images, strict=True)
    ]
    depths = [
        None if image is None or image.depth_m is None else _ideal_depth(ideal, image.depth_m)
        for ideal, image in zip(ideals, raw.images, strict=True)
    ]
    return Instant(
        index=raw.index,
        time_s=raw.time_s,
        world_from_camera=tuple(
            pose @ ideal.lens_from_camera
            for pose, ideal in zip(raw.world_from_lens, ideals, strict=True)
        ),
        images=tuple(image for image, _ in seen),
        notices=(*raw.notices, *(notice for _, notice in seen if notice is not None)),
        names=tuple(camera.name for camera in rig),
        depths=tuple(depths) if any(depth is not None for depth in depths) else (),
    )


def capture_of_raw(path: Path, rig: Sequence[MountedCamera], raw: RawInstant) -> Capture:
    """Return a capture of one observation, with its images in memory; `path` is for messages."""
    return Capture(
        path=path,
        cameras=tuple(
            CaptureCamera(
                name=camera.name,
                lens=camera.lens,
                rig_from_camera=pose,
                pictures=(
                    None
                    if image is None
                    else ArrayPicture(path=path, label="000000", pixels=image.pixels),
                ),
                mask_paths=(None,),
                depth_paths=(None,),
                depths_m=() if image is None or image.depth_m is None else (image.depth_m,),
            )
            for camera, pose, image in zip(rig, raw.world_from_lens, raw.images, strict=True)
        ),
        world_from_rig=(Pose.identity(),),
        times_s=(raw.time_s,),
    )


def _ideal_depth(ideal: IdealCamera, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.ascontiguousarray(ideal.maps().depth(depth_m), dtype=np.float32)

"""Reads the observations of a capture in sequence, and continues after damaged images."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Pose
from servoid.camera import (
    WHOLE_BITS,
    IdealCamera,
    Picture,
    dark_words,
    likely_bits,
    narrowed,
)
from servoid.capture import Capture, CaptureCamera, Observation
from servoid.errors import ImageError
from servoid.rates import ASSUMED_HZ
from servoid.source.source import Instant
from servoid.words import camera_called

_NO_DEPTH = "the depth image has no distance in any pixel, and is not used"
_MOST_UNKNOWN = 0.5  # an image with more unknown pixels is unusable


def cameras_of(capture: Capture) -> tuple[Camera, ...]:
    """Return the ideal pinhole cameras of a capture's rig.

    Raises:
        CameraError: a lens sees nothing of its image.

    """
    return tuple(camera.ideal.camera for camera in capture.cameras)


def read_instants(capture: Capture, observations: Sequence[Observation]) -> Iterator[Instant]:
    """Read observations in order, each when it is requested.

    An image that cannot be read is left out, with a notice. If the capture has no times, they are
    computed from its rate, or else from `ASSUMED_HZ`.
    """
    for observation in observations:
        seen = [
            _read(camera, picture, observation.index)
            for camera, picture in zip(capture.cameras, observation.pictures, strict=True)
        ]
        measured = [_measured(camera, observation.index) for camera in capture.cameras]
        knows_depth = any(depth is not None for depth, _ in measured)
        yield Instant(
            index=observation.index,
            time_s=time_of(capture, observation),
            world_from_camera=poses_of(capture, observation),
            images=tuple(image for image, _ in seen),
            depths=tuple(depth for depth, _ in measured) if knows_depth else (),
            notices=tuple(notice for _, notice in (*seen, *measured) if notice is not None),
            names=tuple(camera.name for camera in capture.cameras),
        )


def poses_of(capture: Capture, observation: Observation) -> tuple[Pose, ...]:
    """Return world_from_camera of each ideal pinhole camera in one observation."""
    return tuple(
        observation.world_from_rig @ camera.rig_from_camera @ camera.ideal.lens_from_camera
        for camera in capture.cameras
    )


def tidy_image(image: NDArray[Any]) -> tuple[NDArray[np.uint8] | None, str | None]:
    """Convert an image of any depth to uint8; also return what was wrong with it, or None.

    `image` is (H, W) or (H, W, C): uint8 unchanged, uint16 by its upper byte, with a notice where
    that leaves it nearly black, bool as black and white, floats from 0 to 1, or from 0 to 255 if
    any is above 1. Unknown pixels, NaN or infinite,
    become black; if there are more of them than others, the result is None, as of an image with
    masked pixels. A channel axis of length one is removed, and of four channels the last, alpha,
    is dropped.
    """
    if np.ma.is_masked(image):
        return None, "the image has masked pixels; say what these are, such as image.filled(0)"
    pixels = np.asarray(image)
    if pixels.ndim == 3 and pixels.shape[2] in (1, 4):
        pixels = pixels[..., 0] if pixels.shape[2] == 1 else pixels[..., :3]
    if pixels.size == 0 or pixels.ndim not in (2, 3) or pixels.shape[2:] not in ((), (3,)):
        return None, f"an image has shape (H, W) or (H, W, 3), not {np.shape(image)}"
    notice = None
    if np.issubdtype(pixels.dtype, np.floating):
        known = np.isfinite(pixels)
        unknown = 1.0 - float(known.mean())
        if unknown > _MOST_UNKNOWN:
            return None, f"{100.0 * unknown:.0f} % of the image's pixels are not finite"
        if unknown:
            notice = f"{100.0 * unknown:.2g} % of the image's pixels are not finite, so are black"
        pixels = np.where(known, pixels, 0.0)
        pixels = np.rint(np.clip(pixels * (255.0 if pixels.max() <= 1.0 else 1.0), 0.0, 255.0))
    elif pixels.dtype == np.uint16:
        largest = int(pixels.max())
        notice = dark_words(largest) if largest > 0 and likely_bits(largest) < WHOLE_BITS else None
        pixels = narrowed(pixels)
    elif pixels.dtype == np.bool_:
        pixels = pixels * np.uint8(255)
    elif pixels.dtype != np.uint8:
        return (
            None,
            f"an image of type {pixels.dtype} is not supported; give uint8, uint16 or float",
        )
    return np.ascontiguousarray(pixels, dtype=np.uint8), notice


def ideal_image(
    name: str, ideal: IdealCamera, pixels: NDArray[Any]
) -> tuple[NDArray[np.uint8] | None, str | None]:
    """Return a lens's image as its ideal pinhole sees it, and a notice of what is wrong with it.

    `name` is the camera's, for the notice.
    """
    try:
        image, notice = tidy_image(pixels)
        if image is not None:
            image = ideal.maps().image(image)
    except ImageError as error:
        image, notice = None, str(error)
    return image, None if notice is None else f"{camera_called(name)}: {notice}"


def _read(
    camera: CaptureCamera, picture: Picture | None, index: int
) -> tuple[NDArray[np.uint8] | None, str | None]:
    if picture is None:
        why = camera.absences[index] if camera.absences else None
        reason = "" if why is None else f": {why}"
        return None, f"{camera_called(camera.name)}: there is no image{reason}"
    try:
        pixels = picture.read(camera.lens.size_px)
    except ImageError as error:
        return None, f"{camera_called(camera.name)}: {error}"
    return ideal_image(camera.name, camera.ideal, pixels)


def _measured(camera: CaptureCamera, index: int) -> tuple[NDArray[np.float32] | None, str | None]:
    """Read the depth image of an observation, as the ideal pinhole of its camera sees it."""
    if camera.depth_scale_m is None and not camera.depths_m:
        return None, None
    try:
        recorded = camera.recorded_depth(index)
        if recorded is None:
            return None, None
        if not (np.isfinite(recorded) & (recorded > 0.0)).any():
            return None, f"{camera_called(camera.name)}: {_NO_DEPTH}"
        depth = camera.ideal.maps().depth(recorded)
    except ImageError as error:
        return None, f"{camera_called(camera.name)}: {error}"
    return np.ascontiguousarray(depth, dtype=np.float32), None


def time_of(capture: Capture, observation: Observation) -> float:
    """Return the time of an observation in seconds; from its index if the capture has no times."""
    if observation.time_s is not None:
        return observation.time_s
    return observation.index / (capture.rate_hz or ASSUMED_HZ)

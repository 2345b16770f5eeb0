"""Images as cameras delivered them, to be written to a recording unchanged."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.camera import JPEG, PNG, Picture, read_exif
from servoid.capture import Capture, CaptureCamera, Observation
from servoid.config import IMAGE_FILE, read_bytes
from servoid.errors import CaptureError, ImageError
from servoid.exchange.bags.mcap.messages import Messages
from servoid.exchange.bags.stored.pictures import BagPicture
from servoid.exchange.bags.stored.pixels import COMPRESSED, IMAGE
from servoid.exchange.bags.stored.reader import open_files
from servoid.pose import Pose
from servoid.source import time_of

_FORMS = {JPEG: "jpeg", PNG: "png"}


@dataclass(frozen=True, eq=False)
class RawImage:
    """One image: the bytes of an image file, pixels, or an image message that was read.

    `encoding` is the ROS encoding of pixels, such as rgb8 or 32FC1, and jpeg or png for bytes.
    """

    data: Any
    encoding: str = ""

    def write(self, messages: Messages, stamp_ns: int, frame: str) -> tuple[str, str, bytes]:
        """Return the suffix of its topic, its type and its message."""
        if isinstance(self.data, bytes):
            made = messages.compressed(stamp_ns, frame, self.data, self.encoding)
            return "/compressed", COMPRESSED, made
        if isinstance(self.data, np.ndarray):
            return "", IMAGE, messages.image(stamp_ns, frame, self.data, self.encoding)
        return "", IMAGE, messages.image_like(stamp_ns, frame, self.data)


@dataclass(frozen=True, eq=False)
class RawObservation:
    """One instant of all cameras, before any processing.

    `images` has one entry per camera, None where it delivered nothing. `depths` likewise, (H, W)
    float32 in metres, NaN where unknown, or empty. `world_from_cameras` are the poses of cameras
    that are not fixed to one rig.
    """

    time_s: float
    world_from_rig: Pose
    images: tuple[RawImage | None, ...]
    depths: tuple[NDArray[np.float32] | None, ...] = ()
    world_from_cameras: tuple[Pose, ...] = ()


def raw_observations(
    capture: Capture, observations: Sequence[Observation] | None = None
) -> Iterator[RawObservation]:
    """Yield the observations of a capture as they are stored, each on request.

    Compressed images are passed on unchanged; those of videos are decoded. Unreadable images are
    left out. If the capture has no times, they are computed from its rate.
    """
    chosen = capture.observations() if observations is None else observations
    for observation in chosen:
        yield RawObservation(
            time_s=time_of(capture, observation),
            world_from_rig=observation.world_from_rig,
            images=tuple(
                raw_image(camera, picture)
                for camera, picture in zip(capture.cameras, observation.pictures, strict=True)
            ),
            depths=tuple(raw_depth(camera, observation.index) for camera in capture.cameras),
        )


def raw_image(camera: CaptureCamera, picture: Picture | None) -> RawImage | None:
    """Return an image as it is stored, None if there is none or it cannot be read."""
    if picture is None:
        return None
    try:
        if isinstance(picture, BagPicture):
            return open_files(picture.path).decode(picture.message(), _as_recorded)
        if type(picture) is Picture and picture.index is None:
            data = read_bytes(picture.path, ImageError, IMAGE_FILE)
            form = next((form for start, form in _FORMS.items() if data.startswith(start)), None)
            is_turned = picture.upright and read_exif(data).is_turned
            if form is not None and not is_turned:
                return RawImage(data, form)
        return RawImage(picture.read(camera.lens.size_px), "rgb8")
    except (CaptureError, ImageError):
        return None


def _as_recorded(image: Any) -> RawImage:
    if hasattr(image, "encoding"):
        return RawImage(image)
    return RawImage(bytes(image.data), image.format)


def raw_depth(camera: CaptureCamera, index: int) -> NDArray[np.float32] | None:
    """Return a depth image as it was recorded, None if there is none or it cannot be read."""
    try:
        return camera.recorded_depth(index)
    except (CaptureError, ImageError):
        return None

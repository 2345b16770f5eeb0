"""Converts a recording to another format: MCAP or a folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from servoid.camera import JPEG, Picture, decode_bytes
from servoid.capture import Capture, CaptureCamera, Observation
from servoid.cli.source.recorders import is_mcap, mcap_writing
from servoid.errors import ImageError
from servoid.exchange.bags.writing import raw_depth, raw_image
from servoid.pose import Pose
from servoid.record import FolderRecorder
from servoid.source import MountedCamera, RawImage, RawInstant, time_of

_AS_STORED = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION

CountCallback = Callable[[int], None]
"""A callback that receives the number of observations written so far."""


@dataclass(frozen=True)
class Converted:
    """The number of observations written, and why images of a folder were left out."""

    observations: int
    unread: tuple[str, ...] = ()


def convert(
    capture: Capture, out: Path, watch: CountCallback, *, is_calibrated: bool = True
) -> Converted:
    """Write a capture as MCAP or into a folder.

    JPEG files are copied unchanged. Unless it `is_calibrated`, a folder contains no calibration.

    Raises:
        OutputError: it cannot be written.
        CaptureError: this version of servoid writes no MCAP.
        ImageError: no image can be read.

    """
    if is_mcap(out):
        writing = mcap_writing()
        observations = writing.raw_observations(capture)
        return Converted(writing.write_mcap_recording(out, capture.cameras, observations, watch))
    rig = [MountedCamera(one.name, one.lens, one.rig_from_camera) for one in capture.cameras]
    recorder = FolderRecorder(out, rig, is_calibrated=is_calibrated)
    read = 0
    unread: list[str] = []
    # Without a calibration, the frame of the first camera is that of the rig.
    seat = Pose.identity() if is_calibrated else rig[0].rig_from_camera
    try:
        for observation in capture.observations():
            raw = _raw(capture, observation, unread)
            read += sum(image is not None for image in raw.images)
            recorder.add(raw, observation.world_from_rig @ seat)
            watch(len(recorder))
        if unread and not read:
            raise ImageError(f"not one image can be read; the first: {unread[0]}")
        recorder.close()
    except BaseException:
        recorder.discard()
        raise
    return Converted(len(recorder), tuple(unread))


def _raw(capture: Capture, observation: Observation, unread: list[str]) -> RawInstant:
    """Read one observation; errors of images that cannot be read are added to `unread`."""
    index, time_s = observation.index, time_of(capture, observation)
    return RawInstant(
        index=index,
        time_s=time_s,
        images=tuple(_image(camera, index, time_s, unread) for camera in capture.cameras),
        world_from_lens=tuple(
            observation.world_from_rig @ camera.rig_from_camera for camera in capture.cameras
        ),
    )


def _image(camera: CaptureCamera, index: int, time_s: float, unread: list[str]) -> RawImage | None:
    """Read one image with its depth; None if there is none, or it cannot be read."""
    picture = camera.pictures[index]
    if picture is None:
        return None
    try:
        pixels = picture.read(camera.lens.size_px)
    except ImageError as error:
        unread.append(str(error))
        return None
    encoded = _jpeg(camera, picture, pixels)
    return RawImage(pixels, time_s, index + 1, raw_depth(camera, index), encoded)


def _jpeg(camera: CaptureCamera, picture: Picture, pixels: np.ndarray) -> bytes | None:
    """Return the JPEG file of an image, if a capture would read the same pixels from it."""
    stored = raw_image(camera, picture)
    data = None if stored is None else stored.data
    if not isinstance(data, bytes) or not data.startswith(JPEG):
        return None
    read = decode_bytes(data, str(picture.path), _AS_STORED, camera.lens.size_px, ImageError)
    return data if np.array_equal(read[..., ::-1], pixels) else None

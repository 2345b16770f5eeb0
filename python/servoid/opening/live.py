"""Opens a live SOURCE: running cameras, streams, simulated worlds."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from servoid.brief import brief
from servoid.errors import CaptureError
from servoid.opening.given_calibration import GivenCalibration
from servoid.opening.word import Kind, SourceWord
from servoid.source import (
    Delivery,
    Device,
    HalvesVideo,
    Live,
    LiveCamera,
    LiveSettings,
    MountedCamera,
    Video,
    opened,
    read_rig,
)

_FIRST_S = 5.0  # within which a device must deliver its first image
_LONE, _PAIR = ("camera",), ("left", "right")


@dataclass(frozen=True, eq=False)
class OpenedLive:
    """A live source, and the assumptions about it, as messages for the user."""

    source: Live
    notes: tuple[str, ...] = ()

    __repr__ = brief


def open_live(
    word: SourceWord,
    known: GivenCalibration | None = None,
    *,
    clock: Callable[[], float] = time.monotonic,
    settings: LiveSettings | None = None,
) -> OpenedLive:
    """Open a live source, which the caller closes. The times of its images are on `clock`.

    Raises:
        CaptureError: the source is recorded, does not answer, or has no calibration.
        CameraError, PoseError: a camera in a rig's file is impossible.
        SimError: there is no such simulated world.
        MissingExtraError: a driver's library is not installed.

    """
    known = known or GivenCalibration()
    if not word.is_live:
        raise CaptureError(f"{word} is recorded, and not a live source")
    if known.rate_hz is not None:
        raise CaptureError(f"{word} is live, and the device sets its rate; leave --rate out")
    cameras, notes = _cameras(word, known)
    return OpenedLive(Live(cameras, clock=clock, settings=settings), notes)


def _cameras(
    word: SourceWord, known: GivenCalibration
) -> tuple[tuple[LiveCamera, ...], tuple[str, ...]]:
    if word.kind in (Kind.SIM, Kind.RIG, Kind.REALSENSE):
        known.refuse(word.text)
        if word.kind is Kind.SIM:
            from servoid.sim.world import open_world

            return open_world(word.name), ()
        if word.kind is Kind.RIG:
            return read_rig(word.place), ()
        from servoid.source.devices import open_realsense

        return open_realsense(word.name), ()
    if word.kind is Kind.GENICAM:
        from servoid.source.devices import GenicamVideo

        video = GenicamVideo(word.name)
        try:
            return _seen(word, known, video, video.size_px)
        except BaseException:
            video.release()
            raise
    device = int(word.name) if word.name.isdigit() else word.name
    size_px = None if known.calibration is not None else _size_px(word, device)
    return _seen(word, known, device, size_px)


def _seen(
    word: SourceWord, known: GivenCalibration, device: Device, size_px: tuple[int, int] | None
) -> tuple[tuple[LiveCamera, ...], tuple[str, ...]]:
    """Return the camera, or the two side by side in one device, with what is known of them."""
    names = _PAIR if word.halves else _LONE
    sizes_px = None
    if size_px is not None:
        width = size_px[0] // 2 if word.halves else size_px[0]
        sizes_px = [(width, size_px[1])] * len(names)
    rig = known.rig(word.text, names, sizes_px)
    if word.halves:
        width, height = rig.cameras[0].lens.size_px
        whole_px = (2 * width, height)
        whole = HalvesVideo(lambda: opened(word.text, device, whole_px))
        return _mounted(rig.cameras, whole), rig.notes
    return _mounted(rig.cameras, device), rig.notes


def _mounted(cameras: Sequence[MountedCamera], device: Device) -> tuple[LiveCamera, ...]:
    return tuple(LiveCamera(one.name, device, one.lens, one.rig_from_camera) for one in cameras)


def _size_px(word: SourceWord, device: int | str) -> tuple[int, int]:
    """Open a device, and return the size of its first image."""
    video = opened("camera", device)
    try:
        return _first_size(word, video)
    finally:
        video.release()


def _first_size(word: SourceWord, video: Video) -> tuple[int, int]:
    end_s = time.monotonic() + _FIRST_S
    while time.monotonic() < end_s:
        if not video.grab():
            continue
        found, data = video.retrieve()
        if found:
            pixels = data.images[0] if isinstance(data, Delivery) else data
            height, width = np.asarray(pixels).shape[:2]
            return width, height
    raise CaptureError(f"{word}: no image arrived within {_FIRST_S:.0f} s; check the camera")

"""Reads the images of a video file in sequence."""

import itertools
import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import Condition
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera
from servoid.camera.images import check_size, shrink
from servoid.config import check_regular, unreadable
from servoid.errors import CaptureError, ImageError

if TYPE_CHECKING:
    import cv2

VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v")

_KEPT = 32  # decoded images: threads request neighbours, not quite in order
_LEAST_KEPT = 12  # more than the number of reading threads
_KEPT_BYTES = 1 << 28
_OPEN = 4  # videos that stay open: a video that is reopened is decoded from its start
_LARGEST_SIDE_PX = Camera.MAX_SIDE_PX
_MISSING_SHARE = 0.02  # a header may estimate the count from the duration
# The first bytes of containers. Playlists, which may name any other file, are not accepted.
_AVI, _MATROSKA = b"RIFF", b"\x1aE\xdf\xa3"
_MP4_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")


@dataclass(frozen=True)
class VideoFacts:
    """The properties of a video file: `count` images of `size_px` (width, height) pixels.

    `times_s` are the presentation times of the images in seconds from the start, None if the file's
    times do not increase. `rate_hz` is the rate in the header, None if there is none. `turn_deg` is
    the clockwise rotation that the header requests before the images are shown.
    """

    count: int
    size_px: tuple[int, int]
    times_s: tuple[float, ...] | None
    rate_hz: float | None
    turn_deg: int


def count_video_images(path: Path) -> int:
    """Count the images of a video by decoding it from its beginning to its end.

    Raises:
        CaptureError: the file is missing or not a video, or it ends before the number of images in
            its header.

    """
    return describe_video(path).count


def describe_video(path: Path) -> "VideoFacts":
    """Return the count, size and times of a video's images; decodes the whole video.

    Raises:
        CaptureError: as for `count_video_images`.

    """
    return _describe(path, *_version(path, CaptureError))


def shortage(count: int, promised: float) -> str | None:
    """Report a video of which only `count` images can be decoded, if its header promises more."""
    if count >= promised - max(0.5, _MISSING_SHARE * promised):
        return None
    return (
        f"its header promises {promised:.0f} images, but only {count} can be decoded; copy the "
        "file again"
    )


def read_video_image(
    path: Path, index: int, size_px: tuple[int, int], by: int = 1, *, upright: bool = False
) -> NDArray[np.uint8]:
    """Read one image of a video, (H, W, 3) uint8 RGB; reading in order decodes each image once.

    The images of the video have (width, height) pixels; the result is shrunk `by` a factor. The
    rotation that the header requests is applied if `upright` is set, or if only rotated images have
    that size.

    Raises:
        ImageError: the file is missing or not a video, ends before the image, or has another size.

    """
    import cv2

    stream = _stream(path, *_version(path, ImageError))
    pixels = stream.read(index)
    # If only the rotated images have the camera's size, the camera was calibrated with those.
    if upright or pixels.shape[:2] == size_px != size_px[::-1]:
        pixels = _turned(pixels, stream.turn_deg)
    check_size(path, (pixels.shape[1], pixels.shape[0]), size_px, ImageError)
    return np.asarray(cv2.cvtColor(shrink(pixels, by), cv2.COLOR_BGR2RGB), dtype=np.uint8)


def upright_images(path: Path) -> Iterator[NDArray[np.uint8]]:
    """Decode a video from its start, yielding each image upright as (H, W, 3) uint8 RGB.

    Phones record how they were held; the rotation in the header is applied.

    Raises:
        CaptureError: the file is missing or not a video.

    """
    import cv2

    check_regular(path, CaptureError)
    video = _open(path, CaptureError)
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)
    try:
        while True:
            found, pixels = video.read()
            if not found:
                return
            yield np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), dtype=np.uint8)
    finally:
        video.release()


def _version(path: Path, error: type[CaptureError] | type[ImageError]) -> tuple[int, int]:
    """Return what changes when a file is rewritten: its size and modification time."""
    check_regular(path, error)
    status = path.stat()
    return status.st_size, status.st_mtime_ns


@lru_cache(maxsize=64)
def _describe(path: Path, _size: int, _changed: int) -> VideoFacts:
    import cv2

    video = _open(path, CaptureError)
    promised = video.get(cv2.CAP_PROP_FRAME_COUNT)
    width, height = _size_px(video)
    rate_hz, turn_deg = video.get(cv2.CAP_PROP_FPS), video.get(cv2.CAP_PROP_ORIENTATION_META)
    times_ms: list[float] = []
    while video.grab():
        times_ms.append(video.get(cv2.CAP_PROP_POS_MSEC))
    video.release()
    count = len(times_ms)
    if count == 0:
        raise CaptureError(f"{path} holds no image that can be decoded; replace the file")
    short = shortage(count, promised)
    if short is not None:
        raise CaptureError(
            f"{path} is cut short or damaged: {short}, or write those {count} to a new one"
        )
    rises = all(before < after for before, after in itertools.pairwise(times_ms))
    return VideoFacts(
        count=count,
        size_px=(round(width), round(height)),
        times_s=tuple(time_ms / 1e3 for time_ms in times_ms) if rises and count > 1 else None,
        rate_hz=rate_hz if 0.0 < rate_hz < math.inf else None,
        turn_deg=round(turn_deg) % 360,
    )


class _Stream:
    """Decodes one video forwards, and caches the last images."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._turn = Condition()
        self._busy = False
        self._waiting: list[int] = []
        self._video: cv2.VideoCapture | None = None
        self._next = 0
        self.turn_deg = 0
        self._most = _KEPT
        self._kept: OrderedDict[int, cv2.typing.MatLike] = OrderedDict()

    def read(self, index: int) -> "cv2.typing.MatLike":
        # Of the waiting threads, the one that wants the earliest image goes first; otherwise the
        # video would have to be restarted for the threads that were overtaken.
        with self._turn:
            self._waiting.append(index)
            try:
                self._turn.wait_for(lambda: not self._busy and min(self._waiting) == index)
                self._busy = True
            finally:
                self._waiting.remove(index)
                self._turn.notify_all()
        try:
            return self._decode(index)
        finally:
            with self._turn:
                self._busy = False
                self._turn.notify_all()

    def _decode(self, index: int) -> "cv2.typing.MatLike":
        import cv2

        if index in self._kept:
            return self._kept[index]
        if self._video is None or index < self._next:
            self._video, self._next = _open(self._path, ImageError), 0
            self.turn_deg = int(self._video.get(cv2.CAP_PROP_ORIENTATION_META))
        while self._next <= index:
            self._step(self._video, keep=index - self._next < _KEPT)
        return self._kept[index]

    def _step(self, video: "cv2.VideoCapture", *, keep: bool) -> None:
        found = video.grab()
        if found and keep:
            found, pixels = video.retrieve()
            if found:
                self._most = min(max(_KEPT_BYTES // max(pixels.nbytes, 1), _LEAST_KEPT), _KEPT)
                self._kept[self._next] = pixels
        if not found:
            self._kept.pop(self._next, None)
            self._video = None
            raise ImageError(
                f"{self._path} ends at image {self._next}, or is damaged there; copy the file again"
            )
        self._next += 1
        while len(self._kept) > self._most:
            self._kept.popitem(last=False)


def _turned(pixels: "cv2.typing.MatLike", turn_deg: int) -> "cv2.typing.MatLike":
    """Rotate an image clockwise by the angle in a header: 0, 90, 180 or 270 degrees."""
    import cv2

    turns = {
        90: cv2.ROTATE_90_CLOCKWISE,
        180: cv2.ROTATE_180,
        270: cv2.ROTATE_90_COUNTERCLOCKWISE,
    }
    turn = turns.get(turn_deg)
    return pixels if turn is None else cv2.rotate(pixels, turn)


@lru_cache(maxsize=_OPEN)
def _stream(path: Path, _size: int, _changed: int) -> _Stream:
    return _Stream(path)


def _size_px(video: "cv2.VideoCapture") -> tuple[float, float]:
    import cv2

    return video.get(cv2.CAP_PROP_FRAME_WIDTH), video.get(cv2.CAP_PROP_FRAME_HEIGHT)


def _open(path: Path, error: type[CaptureError] | type[ImageError]) -> "cv2.VideoCapture":
    import cv2

    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as reason:
        raise unreadable(path, reason, error) from reason
    if not start:
        raise error(f"{path} is empty; replace the file")
    if not (start.startswith((_AVI, _MATROSKA)) or start[4:8] in _MP4_BOXES):
        raise error(
            f"{path} is not a video: it does not begin like an MP4, MOV, AVI, MKV or WebM file"
        )
    video = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not video.isOpened():
        raise error(
            f"{path} cannot be opened as a video: it is cut short, damaged or of a codec "
            "that OpenCV cannot decode; convert it, for instance to MP4"
        )
    width, height = _size_px(video)
    if max(width, height) > _LARGEST_SIDE_PX:
        raise error(
            f"{path} claims images of {width:.0f}x{height:.0f} pixels; servoid takes at most "
            f"{_LARGEST_SIDE_PX} along a side"
        )
    # As with an image's EXIF orientation, the calibration may not know of the requested rotation.
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return video

"""Writes a video image by image, whole or not at all."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError
from servoid.output import check_file, written_beside
from servoid.record.overlay import Overlay
from servoid.track import TrackStep
from servoid.words import counted

_CODEC = "mp4v"


def check_video(path: Path) -> None:
    """Check that a video can be written to `path`.

    Raises:
        OutputError: it does not end in .mp4, or nothing can be written there.

    """
    check_video_suffix(path)
    check_file(path)


def check_video_suffix(path: Path) -> None:
    """Check that a name is that of a video.

    Raises:
        OutputError: it does not end in .mp4.

    """
    if path.suffix.lower() != ".mp4":
        raise OutputError(f"cannot write {path}: a video ends in .mp4")


@contextmanager
def image_video(
    path: str | Path, size_px: tuple[int, int], rate_hz: float
) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    """Write an MP4 file to `path`; call the yielded function with each image.

    The file is complete when the block ends; if the block raises, nothing is left behind. Images
    are (H, W, 3) uint8 RGB of `size_px`, which is even. `rate_hz` is the images per second.

    Raises:
        OutputError: there is no encoder, or the file cannot be written.

    """
    path = Path(path)
    check_video(path)
    with written_beside(path) as partial:
        writer = _open(path, partial, rate_hz, size_px)
        count = 0

        def add(image: NDArray[np.uint8]) -> None:
            nonlocal count
            writer.write(cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
            count += 1

        try:
            yield add
        finally:
            writer.release()
        _check_written(path, partial, count)


@contextmanager
def overlay_video(
    path: str | Path, overlay: Overlay, rate_hz: float
) -> Iterator[Callable[[TrackStep], None]]:
    """Write a video of tracking as `image_video` does; call the yielded function with each step.

    Raises:
        OutputError: there is no encoder, or the file cannot be written.

    """
    with image_video(path, overlay.size_px, rate_hz) as add:
        yield lambda step: add(overlay.draw(step))


def _check_written(path: Path, partial: Path, count: int) -> None:
    """Check that all images are in a video, since the encoder does not report a full disk.

    The index, which counts the images, is written last, and the last image just before it; so if
    both are there, nothing before them is missing.
    """
    if not partial.is_file() or partial.stat().st_size == 0:
        raise OutputError(f"cannot write {path}: the encoder wrote nothing; is the disk full?")
    if count == 0:
        return
    video = cv2.VideoCapture(str(partial), cv2.CAP_FFMPEG)
    found = round(video.get(cv2.CAP_PROP_FRAME_COUNT)) if video.isOpened() else 0
    video.set(cv2.CAP_PROP_POS_FRAMES, count - 1)
    is_whole = found == count and video.read()[0]
    video.release()
    if not is_whole:
        raise OutputError(
            f"cannot write {path}: the encoder took {counted(count, 'image')}, but "
            "not all of them can be read back; is the disk full?"
        )


def _open(path: Path, partial: Path, rate_hz: float, size_px: tuple[int, int]) -> cv2.VideoWriter:
    fourcc = cv2.VideoWriter.fourcc(*_CODEC)
    writer = cv2.VideoWriter(str(partial), cv2.CAP_FFMPEG, fourcc, rate_hz, size_px)
    if not writer.isOpened():
        raise OutputError(
            f"cannot write {path}: this build of OpenCV has no MPEG-4 encoder; install "
            "opencv-python-headless from its wheel, or leave the video out"
        )
    return writer

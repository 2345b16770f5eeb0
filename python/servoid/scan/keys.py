"""Selects the key images of a film for a scan: sharp ones, at equal steps of image motion."""

from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from servoid.config import MOST_KEYS
from servoid.scan.footage import Footage

_SMALL_PX = 480  # the longer side of the images in which motion and sharpness are measured
_CORNERS, _QUALITY, _APART_PX = 200, 0.01, 8
_STEP = 0.018  # of the image's diagonal: the image motion from one key image to the next
_LEAST = 24  # also of a film with little motion: its problems are diagnosed from these
_NOISE = 2e-4  # of the diagonal: apparent motion of corners in a still image


def choose_keys(
    footage: Footage, wanted: Collection[str] = (), progress: Callable[[float], None] | None = None
) -> list[str]:
    """Return the names of a film's key images in order; of photographs, all.

    The path of the image motion, from the median flow of corners between images, is cut into equal
    parts, and the sharpest image of each part is selected. The first image and those in `wanted`
    are always included.
    """
    if not footage.is_film:
        return list(footage.names)
    names = list(footage.names)
    moved, sharp = _watch(footage, names, progress)
    keys = _sharpest(moved, sharp)
    chosen = {names[index] for index in keys} | {names[0]} | (set(wanted) & set(names))
    return [name for name in names if name in chosen]


def _watch(
    footage: Footage, names: Sequence[str], progress: Callable[[float], None] | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the accumulated image motion at each image, in diagonals, and its sharpness."""
    import cv2

    way, sharp = [0.0], []
    before = None
    for index, (_, image) in enumerate(footage.images(names)):
        grey = _small(np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8))
        sharp.append(float(cv2.Laplacian(grey, cv2.CV_32F).var()))
        if before is not None:
            way.append(way[-1] + _motion(before, grey))
        before = grey
        if progress is not None:
            progress((index + 1) / len(names))
    return np.array(way), np.array(sharp)


def _small(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    by = _SMALL_PX / max(grey.shape)
    if by >= 1.0:
        return grey
    size = max(1, round(by * grey.shape[1])), max(1, round(by * grey.shape[0]))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), np.uint8)


def _motion(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> float:
    """Return the median motion of corners between two images, as a share of the diagonal."""
    import cv2

    corners = cv2.goodFeaturesToTrack(before, _CORNERS, _QUALITY, _APART_PX)
    if corners is None:
        return 0.0
    # The type of the last argument excludes None, which the function accepts.
    found, kept, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None)  # pyright: ignore[reportCallIssue, reportArgumentType]
    ways = np.linalg.norm((found - corners)[kept[:, 0] == 1][:, 0], axis=1)
    share = float(np.median(ways)) / float(np.hypot(*before.shape)) if len(ways) else 0.0
    return share if share > _NOISE else 0.0


def _sharpest(way: NDArray[np.float64], sharp: NDArray[np.float64]) -> list[int]:
    """Return the index of the sharpest image in each of equal parts of the motion."""
    count = int(np.clip(np.ceil(way[-1] / _STEP), _LEAST, MOST_KEYS))
    if count >= len(way):
        return list(range(len(way)))
    if way[-1] < _LEAST * _NOISE:  # the camera is stationary
        return [int(index) for index in np.linspace(0, len(way) - 1, count).round()]
    part = np.minimum((way / way[-1] * count).astype(np.int64), count - 1)
    chosen = []
    for number in range(count):
        inside = np.flatnonzero(part == number)
        if len(inside):
            chosen.append(int(inside[np.argmax(sharp[inside])]))
    return chosen

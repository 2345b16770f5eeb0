"""Checks whether the depth images of a recording change as its images do."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from servoid.capture.capture import CaptureCamera
from servoid.capture.matched_features import FIRST_OF_VIDEO, LONG_PX
from servoid.capture.neighbours import Album, evenly, is_video
from servoid.errors import ServoidError

_COMPARED = 6  # pairs of neighbouring observations
_LEAST = 2  # pairs whose images change
_CHANGE = 24  # grey levels: more than noise
_SHARE = 0.005  # of the pixels of images that change


def doubt_depth(album: Album, *, among: Sequence[int] | None = None) -> str | None:
    """Return a message if depth images of a camera never change, while its images do, else None.

    Sensors are noisy, so that no two depth images are equal, not even of a scene at rest.
    """
    for at, camera in enumerate(album.capture.cameras):
        there = _with_depth(camera, range(len(album.capture)) if among is None else among)
        starts = [index for index, after in pairwise(there) if after == index + 1]
        moved = [
            index
            for index in (starts[place] for place in evenly(len(starts), _COMPARED))
            if _changes(album, at, index)
        ]
        if len(moved) >= _LEAST and all(_is_same(camera, index) for index in moved):
            return (
                f"the depth images of camera {camera.name} do not change while its images do, in "
                f"all {len(moved)} pairs of observations that were compared: they are of another "
                "time; record each with its image, or leave the depth out"
            )
    return None


def _with_depth(camera: CaptureCamera, among: Sequence[int]) -> list[int]:
    """List the observations that have an image and a depth image."""
    depths = camera.depths_m or camera.depth_paths
    end = FIRST_OF_VIDEO if is_video(camera) else len(depths)
    return [
        index
        for index in among
        if index < end and depths[index] is not None and camera.pictures[index] is not None
    ]


def _changes(album: Album, camera: int, index: int) -> bool:
    """Return whether an image and the next one differ by more than noise."""
    here, after = (_levels(album, camera, at) for at in (index, index + 1))
    if here is None or after is None:
        return False
    return bool(np.mean(np.abs(here - after) > _CHANGE) > _SHARE)


def _levels(album: Album, camera: int, index: int) -> NDArray[np.int16] | None:
    """Read the grey levels of an image, shrunk; None if it cannot be read."""
    posed = album.posed(camera, index)
    shrunk = None if posed is None else posed.grey(LONG_PX // 2)
    return None if shrunk is None else shrunk[0].astype(np.int16)


def _is_same(camera: CaptureCamera, index: int) -> bool:
    try:
        one, other = camera.recorded_depth(index), camera.recorded_depth(index + 1)
    except ServoidError:
        return False  # where it is used, it is reported
    if one is None or other is None:
        return False
    return bool(np.isfinite(one).any()) and np.array_equal(one, other, equal_nan=True)

"""Finds images of a capture that look at the same things, and matches their features.

Views are neighbours if they are of one static scene, from places near each other. Two cameras of a
rig look at the same things at the same instants, whether these rest or not.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Pose
from servoid.camera import Recorded
from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.matched_features import (
    FIRST_OF_VIDEO,
    LONG_PX,
    MatchedFeatures,
    PosedPicture,
    match_features,
    unit_px,
)
from servoid.pose import exact

APART = (0.1,)
"""Least distance of neighbours, as a share of the spread of the views: nearer constrains nothing"""
FAR_APART = (0.5, 0.1)
"""The same of a rig that moves, of which there are many; the first with common features is used."""
_MOVED_PX = 4.0  # at 1000 px of diagonal: features that moved less say nothing


@dataclass(frozen=True, eq=False)
class PosedView:
    """The camera and the observation of an image, by their indices, and the pose of its lens."""

    camera: int
    index: int
    world_from_lens: Pose


class Album:
    """The images of a capture, shrunk towards `long_px`; features of each are found once."""

    def __init__(self, capture: Capture, *, long_px: int = LONG_PX) -> None:
        self.capture = capture
        self._long_px = long_px
        self._found: dict[tuple[int, int], PosedPicture] = {}

    def views(self) -> list[PosedView]:
        """List the images that are compared, by observation; late ones of a video are not."""
        cameras = self.capture.cameras
        return [
            PosedView(place, index, pose @ camera.rig_from_camera)
            for index, pose in enumerate(self.capture.world_from_rig)
            for place, camera in enumerate(cameras)
            if camera.pictures[index] is not None
            and (index < FIRST_OF_VIDEO or not is_video(camera))
        ]

    def posed(self, camera: int, index: int) -> PosedPicture | None:
        """Return the image of a camera in an observation, if there is one."""
        one = self.capture.cameras[camera]
        picture = one.pictures[index]
        if picture is None:
            return None
        made = PosedPicture(picture, one.lens, Recorded(one.lens.size_px), self._long_px)
        return self._found.setdefault((camera, index), made)

    def match(self, one: PosedView, other: PosedView) -> MatchedFeatures | None:
        """Match the features of two views; return None if there are too few."""
        first, second = (self.posed(view.camera, view.index) for view in (one, other))
        if first is None or second is None:
            return None
        second_from_first = other.world_from_lens.inverse() @ one.world_from_lens
        return match_features(first, second, second_from_first)


def matched_neighbours(
    album: Album, views: Sequence[PosedView], *, count: int, apart: Sequence[float] = APART
) -> list[tuple[PosedView, MatchedFeatures]]:
    """Match `count` of the views, evenly chosen, with others; return them with their features.

    A neighbour is of another observation, and the nearest of those that are not nearer than a share
    of the spread, the first in `apart` at which the two have features in common.
    """
    places = np.array([view.world_from_lens.translation for view in views]).reshape(-1, 3)
    spread = float(np.sqrt(places.var(axis=0).sum())) if views else 0.0
    found = []
    for place in evenly(len(views), count):
        lengths = exact.lengths(places - places[place])
        lengths[[view.index == views[place].index for view in views]] = np.inf
        for share in apart:
            far = np.where(lengths > share * spread, lengths, np.inf)
            nearest = int(far.argmin())
            if not np.isfinite(far[nearest]):
                continue
            pair = album.match(views[place], views[nearest])
            if pair is not None and _moves(pair):
                found.append((views[place], pair))
                break
    return found


def _moves(pair: MatchedFeatures) -> bool:
    """Return whether features are elsewhere in the second image."""
    moved_px = float(np.median(exact.lengths(pair.second_px - pair.first_px)))
    return moved_px > _MOVED_PX * unit_px(pair.lenses[0])


def is_video(camera: CaptureCamera) -> bool:
    """Return whether its images are those of a video, where late ones take long to reach."""
    return any(picture is not None and picture.index is not None for picture in camera.pictures)


def in_both(one: CaptureCamera, other: CaptureCamera) -> list[int]:
    """Return the observations in which two cameras have images."""
    pairs = enumerate(zip(one.pictures, other.pictures, strict=True))
    return [at for at, (a, b) in pairs if a is not None and b is not None]


def second_from_first(first: CaptureCamera, second: CaptureCamera) -> Pose:
    """Return the pose of the first camera in the frame of the second, on their rig."""
    return second.rig_from_camera.inverse() @ first.rig_from_camera


def matched_at(
    album: Album, cameras: tuple[int, int], indices: Iterable[int]
) -> Iterator[MatchedFeatures]:
    """Match two cameras of a rig in some observations; those with too few features are left out."""
    for index in indices:
        one, other = (
            PosedView(place, index, album.capture.cameras[place].rig_from_camera)
            for place in cameras
        )
        pair = album.match(one, other)
        if pair is not None:
            yield pair


def evenly(count: int, most: int) -> list[int]:
    """Choose up to `most` of `count` indices, evenly."""
    if count == 0:
        return []
    return np.unique(np.linspace(0, count - 1, most).round().astype(int)).tolist()

"""Keeps the data that a report of a track needs beyond its estimates, without full images."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Pose
from servoid.brief import brief
from servoid.capture import Capture
from servoid.source import Instant, cameras_of
from servoid.track.following import TrackStep
from servoid.track.starting import Followed, placed

MOST_CHANGES = 12  # changes kept of one object; beyond that, every second one is dropped
THUMBNAIL_PX = 200
_MARGIN = 1.2  # of a thumbnail, as a multiple of the object

Colors = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class BodyChange:
    """One change of a body: the body before and after observation `index`, in its own frame.

    `thumbnail` (P, P, 3) uint8 RGB is a camera's image of the object then, None if no camera saw
    it.
    """

    index: int
    time_s: float
    before: Body
    after: Body
    thumbnail: Colors | None

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class LearnedSurface:
    """The learned surface: points (N, 3) in metres, colors (N, 3) uint8 RGB."""

    points: NDArray[np.float64]
    colors: Colors

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class History:
    """The history of the track of one object.

    `names` are the C cameras'; `world_from_camera` has C poses, and `delivered` (N, C) bool says
    which cameras delivered an image, for each of the N observations. `initial` is the body at the
    start; `changes` are its changes, at most `MOST_CHANGES`, chosen about evenly among all.
    """

    names: tuple[str, ...]
    world_from_camera: Sequence[tuple[Pose, ...]]
    delivered: NDArray[np.bool_]
    initial: Body
    changes: tuple[BodyChange, ...]
    surface: LearnedSurface
    thumbnail: Colors | None = None

    __repr__ = brief


@dataclass
class _Growth:
    """The changes of one body so far, of which only some are kept."""

    initial: Body
    newest: Body
    thumbnail: Colors | None
    changes: list[BodyChange] = field(default_factory=list)
    count: int = 0
    stride: int = 1

    def add(self, change: BodyChange) -> None:
        if self.count % self.stride == 0:
            self.changes.append(change)
        self.count += 1
        if len(self.changes) > MOST_CHANGES:
            self.changes = self.changes[::2]
            self.stride *= 2


class Historian:
    """Collects the histories of all objects, step by step.

    Of the images it keeps only a thumbnail for each change that it keeps.
    """

    def __init__(self, capture: Capture) -> None:
        self._cameras = cameras_of(capture)
        self._names = tuple(camera.name for camera in capture.cameras)
        self._poses: list[tuple[Pose, ...]] = []
        self._delivered: list[list[bool]] = []
        self._growths: list[_Growth] = []
        self._objects: tuple[Followed, ...] = ()

    def add(self, step: TrackStep) -> None:
        """Add the new data of a step."""
        instant = step.instant
        self._objects = step.objects
        self._poses.append(instant.world_from_camera)
        self._delivered.append([image is not None for image in instant.images])
        if not self._growths:
            for one, tracked in zip(step.objects, step.tracked, strict=True):
                body = one.body_at(tracked.estimate.world_from_object)
                seen = thumbnail(self._cameras, instant, body)
                self._growths.append(_Growth(one.body, one.body, seen))
        for one, tracked, growth in zip(step.objects, step.tracked, self._growths, strict=True):
            if tracked.evolved:
                before, growth.newest = growth.newest, one.body
                body = placed(before, tracked.estimate.world_from_object)
                seen = thumbnail(self._cameras, instant, body)
                growth.add(BodyChange(instant.index, instant.time_s, before, one.body, seen))

    def histories(self) -> list[History]:
        """Return the history of each object so far, in the order of the objects."""
        return [
            History(
                names=self._names,
                world_from_camera=tuple(self._poses),
                delivered=np.array(self._delivered, dtype=np.bool_),
                initial=growth.initial,
                changes=tuple(growth.changes),
                surface=_surface(one),
                thumbnail=growth.thumbnail,
            )
            for one, growth in zip(self._objects, self._growths, strict=True)
        ]


def thumbnail(cameras: Sequence[Camera], instant: Instant, body: Body) -> Colors | None:
    """Return a square cut around a body, (P, P, 3) uint8 RGB, of the first camera that shows it."""
    for camera, pose, image in zip(cameras, instant.world_from_camera, instant.images, strict=True):
        if image is None:
            continue
        found = [one for one in body.outlines(camera, pose) if one is not None]
        if found:
            return _cut(image, found)
    return None


def _cut(
    image: Colors, outlines: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]
) -> Colors:
    """Return the part of an image around outlines, each a centre in pixels and a covariance."""
    reaches = [(middle, np.sqrt(np.diag(spread))) for middle, spread in outlines]
    low = np.min([middle - reach for middle, reach in reaches], axis=0)
    high = np.max([middle + reach for middle, reach in reaches], axis=0)
    # An outline may be huge; only its part inside the image counts.
    limit = np.array([image.shape[1] - 1, image.shape[0] - 1], dtype=np.float64)
    low, high = np.clip(low, 0.0, limit), np.clip(high, 0.0, limit)
    side = max(_MARGIN * float((high - low).max()), 8.0)
    scale = THUMBNAIL_PX / side
    shift = (THUMBNAIL_PX - 1) / 2.0 - scale * (low + high) / 2.0
    way = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    colored = image if image.ndim == 3 else np.repeat(image[:, :, None], 3, axis=2)
    size = (THUMBNAIL_PX, THUMBNAIL_PX)
    cut = cv2.warpAffine(np.ascontiguousarray(colored), way, size, flags=cv2.INTER_LINEAR)
    return np.asarray(cut, np.uint8)


def _surface(one: Followed) -> LearnedSurface:
    known = getattr(one.tracker, "surface", None)
    points, _ = one.surface
    colors = None if known is None or len(known) < 3 else known[2]
    if colors is None:
        return LearnedSurface(np.empty((0, 3)), np.empty((0, 3), np.uint8))
    return LearnedSurface(points, colors)

"""Computes from which sides an object was seen: directions to the cameras in its frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.pose import Floats
from servoid.track import History, Tracked

SEEN_WITHIN = np.radians(45.0)
"""A side counts as seen if a camera was within this angle, in radians, of its normal."""

_FACES = 4000  # sampled directions, of equal areas


@dataclass(frozen=True, eq=False)
class Sides:
    """The directions from which an object was seen while its pose was tracked.

    `directions` (M, 3) are unit vectors from the object to a camera, in the frame of its sides: x
    to the right, y up and z to the camera, in the first image of the first camera. `times` (M,)
    are seconds, in ascending order, and `cameras` (M,) are indices of cameras.
    `sides_from_object` (3, 3) maps directions in the object's frame to that of its sides.
    """

    directions: Floats
    times: Floats
    cameras: NDArray[np.int64]
    sides_from_object: Floats

    @cached_property
    def share(self) -> float:
        """Return the share of all sides that were seen, 0 to 1."""
        return float(np.isfinite(self.first_seen(all_directions())).mean())

    def first_seen(self, faces: Floats) -> Floats:
        """Return when sides with unit normals (F, 3) were first seen, NaN if never."""
        when = np.full(len(faces), np.nan)
        unseen = np.arange(len(faces))
        for direction, time_s in zip(self.directions, self.times, strict=True):
            near = faces[unseen] @ direction > np.cos(SEEN_WITHIN)
            when[unseen[near]] = time_s
            unseen = unseen[~near]
        return when


def sides_of(tracked: Sequence[Tracked], history: History) -> Sides:
    """Return the directions to the cameras in the observations in which the object was tracked."""
    turn = _sides_from_object(tracked, history)
    directions, times, cameras = [], [], []
    for one, poses, delivered in zip(
        tracked, history.world_from_camera, history.delivered, strict=True
    ):
        if not one.is_tracked:
            continue
        for camera in np.flatnonzero(delivered):
            directions.append(turn @ _toward(poses[camera], one.estimate.world_from_object))
            times.append(one.estimate.time_s)
            cameras.append(int(camera))
    return Sides(
        directions=np.array(directions, dtype=np.float64).reshape(-1, 3),
        times=np.array(times, dtype=np.float64),
        cameras=np.array(cameras, dtype=np.int64),
        sides_from_object=turn,
    )


def all_directions(count: int = _FACES) -> Floats:
    """Return unit vectors (count, 3) of equal areas of the sphere: a golden spiral."""
    places = np.arange(count) + 0.5
    heights = 1.0 - 2.0 * places / count
    angles = np.pi * (1.0 + np.sqrt(5.0)) * places
    level = np.sqrt(1.0 - heights**2)
    spiral = np.stack([level * np.cos(angles), heights, level * np.sin(angles)], axis=1)
    return np.asarray(spiral, np.float64)


def _sides_from_object(tracked: Sequence[Tracked], history: History) -> Floats:
    """Return right, up and toward the camera as rows (3, 3) in the object's frame, at the start."""
    pose, camera = tracked[0].estimate.world_from_object, history.world_from_camera[0][0]
    toward = _toward(camera, pose)
    object_from_camera = pose.matrix()[:3, :3].T @ camera.matrix()[:3, :3]
    up = -object_from_camera[:, 1]
    up = up - toward * (up @ toward)
    up = up / np.linalg.norm(up)
    return np.asarray(np.stack([np.cross(up, toward), up, toward]), np.float64)


def _toward(world_from_camera: Pose, world_from_object: Pose) -> Floats:
    """Return the unit vector from the object to a camera, in the object's frame."""
    place = np.array((world_from_object.inverse() @ world_from_camera).translation)
    return place / np.linalg.norm(place)

"""What the first camera of a rig saw at two instants, and where poses of the rig predict it.

What two cameras see at one instant has a place in space. Where it is at rest, a later image has it
where the rig's poses predict it. What one camera sees is somewhere on a ray, of which a later image
has an arc: that shows neither a wrong unit of length nor errors along the arc.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.camera import Recorded
from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.matched_features import (
    FIRST_OF_VIDEO,
    PosedPicture,
    closest_points,
    match_features,
    unit_px,
    unit_rays,
)
from servoid.capture.mount_fit import Motion, Predicted, seen_motion
from servoid.pose import Floats, exact

Balls = Callable[[int], Sequence[tuple[Floats, float]]]
"""What may move: for an observation, the centres, (3,) in the world, and the radii of balls."""

EXPLAINED_PX = 2.0
"""At 1000 px of diagonal: nearer, poses explain the images."""

_PLACES = 4  # in the recording, at which two instants are compared
_NEARER = 4  # times, if the images of two instants have nothing in common
_LEAST = 20  # features of two instants
_OFF_PX = 8.0  # at 1000 px of diagonal: a hand-eye calibration is usually nearer than this
_NOISE_PX = 1.0  # at 1000 px of diagonal: of a disparity
_MOST_ENLARGED = 8.0  # times, by a shift that is as much longer than the baseline
_ASIDE = 1.2  # of a ball's radius: features of what may move


@dataclass(frozen=True, eq=False)
class Sighting:
    """What a rig saw at one instant, and where it was at another.

    `points` (N, 3) are places in the frame of the first camera at instant `indices[0]`, or unit
    vectors towards them if they are not `located`, and `rays` (N, 3) unit vectors to them from it
    at `indices[1]`.
    """

    indices: tuple[int, int]
    points: Floats
    rays: Floats
    located: bool

    def off_rad(self, one: Pose, other: Pose) -> Floats:
        """Return by how much features are off if the camera moved from one pose to the other."""
        moved = (other.inverse() @ one).matrix()
        points = exact.product(self.points, np.ascontiguousarray(moved[:3, :3].T))
        if not self.located:
            return _off_arc(points, moved[:3, 3], self.rays)
        return _off_direction(points + moved[:3, 3], self.rays)

    def part(self, kept: NDArray[np.bool_] | np.bool_) -> "Sighting":
        """Return those of the features that are `kept`, (N,)."""
        return replace(self, points=self.points[kept], rays=self.rays[kept])


def _off_direction(points: Floats, rays: Floats) -> Floats:
    """Return the sine of the angle between places and unit vectors; infinite if behind."""
    across = exact.lengths(np.cross(points, rays)) / exact.lengths(points)
    return np.where((points * rays).sum(axis=1) > 0.0, across, np.inf)


def _off_arc(far: Floats, start: Floats, rays: Floats) -> Floats:
    """Return the sine of the angle between unit vectors and the arcs on which features are.

    An arc begins at the direction of `start`, (3,), from where a feature is seen if it is near, and
    ends at that of `far`, (N, 3), unit vectors, if it is far away.
    """
    off = _off_direction(far, rays)
    length = exact.norm(start)
    if not length > 0.0:
        return off
    near = np.broadcast_to(start / length, far.shape)
    normals = np.cross(far, near)
    sizes = exact.lengths(normals)
    with np.errstate(divide="ignore", invalid="ignore"):
        beside = np.abs((normals * rays).sum(axis=1)) / sizes
    is_between = (sizes > 0.0) & ((np.cross(normals, far) * rays).sum(axis=1) >= 0.0)
    is_between &= (np.cross(near, normals) * rays).sum(axis=1) >= 0.0
    return np.where(is_between, beside, np.minimum(off, _off_direction(near, rays)))


@dataclass(frozen=True, eq=False)
class SeenRig:
    """The first camera of a rig: its poses, how it is mounted, and what the rig saw."""

    name: str
    world_from_rig: Sequence[Pose]
    rig_from_camera: Pose
    lens: Lens
    baseline_m: float
    seen: Sequence[Sighting]

    def offs_px(self) -> tuple[list[Floats], list[float]]:
        """Return how far features are off, (N,) px, and by how much they may, for each pair."""
        unit = unit_px(self.lens)
        offs, allowed = [], []
        for seen in self.seen:
            one, other = (self.world_from_rig[i] @ self.rig_from_camera for i in seen.indices)
            offs.append(self.lens.focal_px[0] * seen.off_rad(one, other))
            enlarged = 0.0
            if seen.located:
                shift_m = exact.norm(np.subtract(other.translation, one.translation))
                enlarged = min(shift_m / self.baseline_m, _MOST_ENLARGED)
            allowed.append(unit * (_OFF_PX + _NOISE_PX * enlarged))
        return offs, allowed

    def usual_px(self) -> float:
        """Return how far features are off: of each pair the median, and of these the median.

        Of a shift in time, the first or the last pair has no poses.
        """
        return float(np.median([np.median(off) for off in self.offs_px()[0]]))

    def agreeing(self) -> list[float]:
        """Return the share of features that are where poses predict them, for each pair."""
        offs, allowed = self.offs_px()
        return [float(np.mean(off < most)) for off, most in zip(offs, allowed, strict=True)]

    @property
    def error_rad(self) -> float:
        """Return how far a feature may be off that poses explain."""
        return EXPLAINED_PX * unit_px(self.lens) / self.lens.focal_px[0]

    def predicted(self) -> list[Predicted]:
        """Return how the rig moved between pairs of instants, with what has a place in space."""
        pairs = (
            (seen, *(self.world_from_rig[index] for index in seen.indices)) for seen in self.seen
        )
        return [
            Predicted(one.inverse() @ other, seen.points, seen.rays)
            for seen, one, other in pairs
            if seen.located
        ]

    def motions(self) -> list[Motion]:
        """Return how the rig moved between pairs of instants, and what was seen of it."""
        seen = [
            (one.rig_from_later, seen_motion(one.points, one.rays, self.error_rad))
            for one in self.predicted()
        ]
        return [(rig, motion) for rig, motion in seen if motion is not None]


def seen_rig(capture: Capture, may_move: Balls, among: Sequence[int] | None) -> SeenRig | None:
    """Return what a rig saw at pairs of instants; None if no poses of it are given."""
    poses = capture.world_from_rig
    if not capture.is_recording or (rests(poses) and poses[0] == Pose.identity()):
        return None
    first, *others = capture.cameras
    second = next((other for other in others if _baseline_m(first, other) > 0.0), None)
    indices = list(range(len(poses)) if among is None else among)
    if any(picture is not None and picture.index is not None for picture in first.pictures):
        indices = [index for index in indices if index < FIRST_OF_VIDEO]
    last = len(indices) - 1
    places = np.unique(np.linspace(0, last, _PLACES + 1).round().astype(int)).tolist()
    seen = []
    for start, end in pairwise(places):
        nearer = start + max((end - start) // _NEARER, 1)
        begin = indices[start]
        for other in dict.fromkeys((indices[end], indices[nearer])):
            one = _seen(first, second, (begin, other))
            if one is not None:
                world_from_both = [poses[index] @ first.rig_from_camera for index in one.indices]
                seen.append(_at_rest(one, world_from_both, [may_move(i) for i in one.indices]))
                break
    kept = [one for one in seen if len(one.rays) >= _LEAST]
    baseline_m = 0.0 if second is None else _baseline_m(first, second)
    return SeenRig(first.name, poses, first.rig_from_camera, first.lens, baseline_m, kept)


def rests(poses: Sequence[Pose]) -> bool:
    """Return whether all poses are the same."""
    return all(pose == poses[0] for pose in poses)


def _baseline_m(one: CaptureCamera, other: CaptureCamera) -> float:
    apart = np.subtract(other.rig_from_camera.translation, one.rig_from_camera.translation)
    return exact.norm(apart)


def _seen(
    first: CaptureCamera, second: CaptureCamera | None, indices: tuple[int, int]
) -> Sighting | None:
    """Find features of an instant at another, and locate them by a second camera.

    None if they are too few.
    """
    here, later = (_posed(first, index) for index in indices)
    if here is None or later is None:
        return None
    again = match_features(here, later, Pose.identity())
    if again is None:
        return None
    rays = unit_rays(first.lens, again.second_px)
    # A lens with strong distortion sees nothing at some pixels.
    is_seen = np.isfinite(rays).all(axis=1)
    if second is None:
        alone = Sighting(indices, unit_rays(first.lens, again.first_px), rays, located=False)
        return alone.part(is_seen & np.isfinite(alone.points).all(axis=1))
    beside = _posed(second, indices[0])
    from_second = first.rig_from_camera.inverse() @ second.rig_from_camera
    pair = None if beside is None else match_features(here, beside, from_second.inverse())
    if pair is None:
        return None
    places = {tuple(pixel): row for row, pixel in enumerate(pair.first_px.tolist())}
    rows = [places.get(tuple(pixel), -1) for pixel in again.first_px.tolist()]
    seen = Sighting(indices, closest_points(pair)[0][rows], rays, located=True)
    is_ahead = np.isfinite(seen.points).all(axis=1) & (seen.points[:, 2] > 0.0)
    return seen.part((np.array(rows) >= 0) & is_ahead & is_seen)


def _posed(camera: CaptureCamera, index: int) -> PosedPicture | None:
    picture = camera.pictures[index]
    size_px = camera.lens.size_px
    return None if picture is None else PosedPicture(picture, camera.lens, Recorded(size_px))


def _at_rest(
    seen: Sighting,
    world_from_both: Sequence[Pose],
    may_move: Sequence[Sequence[tuple[Floats, float]]],
) -> Sighting:
    """Return what was seen without what is in front of or behind balls that may move."""
    kept = np.ones(len(seen.rays), np.bool_)
    looks = (seen.points / exact.lengths(seen.points)[:, None], seen.rays)
    for rays, pose, balls in zip(looks, world_from_both, may_move, strict=True):
        kept &= beside_balls(rays, pose, balls)
    return seen.part(kept)


def beside_balls(
    rays: Floats, world_from_camera: Pose, balls: Sequence[tuple[Floats, float]]
) -> NDArray[np.bool_]:
    """Return which unit vectors from a camera, (N, 3), pass balls that may move at a distance."""
    kept = np.ones(len(rays), np.bool_)
    camera_from_world = world_from_camera.inverse().matrix()
    for center, radius in balls:
        at = exact.product(camera_from_world[:3, :3], center) + camera_from_world[:3, 3]
        beside = exact.lengths(np.cross(rays, at))
        kept &= (beside > _ASIDE * radius) | ((rays * at).sum(axis=1) < 0.0)
    return kept

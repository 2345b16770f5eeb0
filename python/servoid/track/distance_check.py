"""Compares a body's distance with that which two cameras, or a depth image, measure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Pose
from servoid.capture import CaptureView
from servoid.errors import CameraError, CaptureError, ImageError, TargetError
from servoid.model import depth_of_pair, with_twins
from servoid.pose import Floats, exact
from servoid.shape import body_sides
from servoid.track.doubts import WRONG_M, WRONG_SHARE

_RAYS = 20_000  # at most, of which those that meet the body are compared
_LEAST_RAYS, _LEAST_SHARE = 60, 0.35  # of those inside of the outline, that are measured
_BORDER_PX = 3  # depth at the outline mixes object and background
_CLEARER = 0.5  # part of what correlation lacks at the body's depth, below which it shows another
_WRONG_WAY = 0.03  # of the distance, by which a pose is wrong if that is more
_DOUBTFUL = 0.5  # of that; right bodies of eight recorded pairs are off by 0.2 at most


@dataclass(frozen=True)
class DistanceCheck:
    """Medians of how far a body's surface is, and how far it is measured; all in metres.

    `off_m` is by how much half of the surface is farther than measured, or, where it is negative,
    three quarters are nearer: an opening is measured inside. `allowed_m` is the difference from
    which on a pose is wrong.
    """

    body_m: float
    measured_m: float
    off_m: float
    allowed_m: float

    @classmethod
    def of(cls, expected: Floats, depth: Floats, longest_m: float) -> "DistanceCheck":
        """Compare depths (N,) of a body and as measured, of a body with a longest side."""
        middle, high = map(float, np.quantile(expected - depth, (0.5, 0.75)))
        off_m = max(middle, 0.0) + min(high, 0.0)
        there, here = (float(np.median(one)) for one in (expected, depth))
        return cls(there, here, off_m, max(WRONG_M, WRONG_SHARE * longest_m, _WRONG_WAY * here))

    @property
    def is_wrong(self) -> bool:
        """Return whether the pose is wrong by what is measured."""
        return abs(self.off_m) > self.allowed_m

    @property
    def doubt(self) -> str | None:
        """Report a body that is nearer or farther than what is measured; None if it is not."""
        if abs(self.off_m) <= _DOUBTFUL * self.allowed_m:
            return None
        where = "farther away" if self.off_m > 0.0 else "nearer"
        placed_m = self.measured_m + self.off_m  # medians differ by more where few depths are wrong
        return (
            f"the surface of the body is {1e3 * abs(self.off_m):.0f} mm {where} at the start than "
            f"the cameras measure ({placed_m:.3g} m instead of {self.measured_m:.3g} m): the "
            "body has another size than the object, or the start or the calibration is wrong, "
            "unless the object is hollow or transparent; poses are wrong by as much"
        )


def check_distance(views: Sequence[CaptureView], body: Body) -> DistanceCheck | None:
    """Compare how far a placed body is with what the first cameras that can measure it say.

    `views` are those of one instant. None if no two cameras and no depth image measure it.
    """
    longest_m = float(body_sides(body).max())
    for view, twin in [*((view, None) for view in views), *with_twins(views, views)]:
        if not view.has_image or (twin is None and not view.has_depth):
            continue
        expected = _depths(body, view.camera, view.world_from_camera)
        outline = _outline(expected)
        depth = _measured_depth(view, twin, outline)
        if depth is None:
            continue
        inside = np.isfinite(expected) & _eroded(outline)
        both = inside & np.isfinite(depth) & (depth > 0.0)
        if both.sum() < max(_LEAST_RAYS, _LEAST_SHARE * inside.sum()):
            continue
        measured = depth.astype(np.float64)
        found = DistanceCheck.of(expected[both], measured[both], longest_m)
        if found.doubt is None or twin is None or _shows(view, twin, both, expected, measured):
            return found
    return None


def _measured_depth(
    view: CaptureView, twin: CaptureView | None, outline: NDArray[np.uint8]
) -> NDArray[np.float32] | None:
    try:
        if twin is None:
            return view.depth()
        if not twin.has_image or not outline.any():
            return None
        return depth_of_pair(view, twin, outline)
    except (CameraError, CaptureError, ImageError, TargetError):  # no conclusion
        return None


def _shows(
    view: CaptureView,
    twin: CaptureView,
    pixels: NDArray[np.bool_],
    expected: Floats,
    measured: Floats,
) -> bool:
    """Return whether two images show the measured depth clearly rather than the body's.

    Where an object is plain, its pixels fit at any depth, and stereo takes that of its outline.
    """
    import cv2

    here, there = (
        np.asarray(cv2.cvtColor(one.image(), cv2.COLOR_RGB2GRAY), np.float32)
        for one in (view, twin)
    )
    rows, columns = np.nonzero(pixels)
    rays = _rays(view.camera, columns, rows)
    twin_from_view = twin.world_from_camera.inverse() @ view.world_from_camera

    def lacking(depths: Floats) -> float:
        places = twin.camera.project(twin_from_view.transform(rays * depths[pixels][:, None]))
        x, y = (np.nan_to_num(one, nan=-1.0).astype(np.float32) for one in places.T[:, :, None])
        seen = np.asarray(cv2.remap(there, x, y, cv2.INTER_LINEAR))[:, 0]
        own, seen = (one - one.mean() for one in (here[pixels], seen))
        power = float((own * own).sum()) * float((seen * seen).sum())
        return 1.0 - float((own * seen).sum()) / np.sqrt(power) if power > 0.0 else 1.0

    return lacking(measured) < _CLEARER * lacking(expected)


def _outline(depths: Floats) -> NDArray[np.uint8]:
    """Return the mask of a body, the hull of the pixels in which its depth is known."""
    import cv2

    rows, columns = np.nonzero(np.isfinite(depths))
    mask = np.zeros(depths.shape, np.uint8)
    if len(rows):
        cv2.fillConvexPoly(mask, cv2.convexHull(np.stack([columns, rows], axis=1)), (255,))
    return mask


def _eroded(mask: NDArray[np.uint8]) -> NDArray[np.bool_]:
    import cv2

    kernel = np.ones((2 * _BORDER_PX + 1,) * 2, np.uint8)
    return np.asarray(cv2.erode(mask, kernel)) != 0


def _rays(camera: Camera, columns: NDArray[np.intp], rows: NDArray[np.intp]) -> Floats:
    """Return the rays of pixels (...,) with z = 1, (..., 3) float64."""
    pixels = np.stack([columns, rows], axis=-1)
    ahead = np.asarray((pixels - camera.center_px) / camera.focal_px, np.float64)
    return np.concatenate([ahead, np.ones((*ahead.shape[:-1], 1))], axis=-1)


def _depths(body: Body, camera: Camera, world_from_camera: Pose) -> Floats:
    """Return the depth of a body's surface at each pixel, (H, W) float64 in metres along z.

    NaN where it is not seen, and beside the rays that are computed.
    """
    width, height = camera.size_px
    depths = np.full((height, width), np.nan)
    step = max(1, int(np.ceil(np.sqrt(width * height / _RAYS))))
    columns, rows = np.meshgrid(np.arange(0, width, step), np.arange(0, height, step))
    rays = _rays(camera, columns, rows).reshape(-1, 3)
    camera_from_body = world_from_camera.inverse() @ body.world_from_object
    nearest = np.full(columns.shape, np.inf)
    for center, radii, rotation in zip(body.centers, body.radii, body.rotations, strict=True):
        own = Pose.from_parts((0.0, 0.0, 0.0), rotation)
        turn = (camera_from_body @ own).matrix()[:3, :3]
        # In units of its radii, along its axes, it is a ball.
        to_ball = turn.T / radii[:, None]
        away = exact.product(to_ball, camera_from_body.transform(center[None])[0])
        ways = exact.product(rays, to_ball.T)
        a, b = (ways * ways).sum(axis=1), exact.product(ways, away)
        root = b * b - a * (exact.dot(away, away) - 1.0)
        hit = root > 0.0
        found = np.where(hit, (b - np.sqrt(np.where(hit, root, 0.0))) / a, np.inf)
        found = np.where(found > 0.0, found, np.inf).reshape(columns.shape)
        nearest = np.minimum(nearest, found)
    depths[rows, columns] = np.where(np.isfinite(nearest), nearest, np.nan)
    return depths

"""Compares a body's distance with that which two cameras, or a depth image, measure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Pose
from servoid.capture import CaptureView
from servoid.errors import CameraError, TargetError
from servoid.model import depth_of_pair, with_twins
from servoid.pose import Floats, exact
from servoid.shape import body_sides

_RAYS = 20_000  # about so many, of which those that meet the body are compared
_LEAST_RAYS = 60  # that are measured
_WRONG_M, _WRONG_SHARE = 0.02, 0.1  # of the longest side: the larger one makes a pose wrong
_DOUBTFUL = 0.5  # of that; right bodies of nine recordings are off by 0.2 at most


@dataclass(frozen=True)
class DistanceCheck:
    """Medians of how far a body's surface is, and how far it is measured; all in metres.

    `allowed_m` is the difference from which on a pose is wrong.
    """

    body_m: float
    measured_m: float
    allowed_m: float

    @property
    def is_wrong(self) -> bool:
        """Return whether the pose is wrong by what is measured."""
        return abs(self.body_m - self.measured_m) > self.allowed_m

    @property
    def doubt(self) -> str | None:
        """Report a body that is nearer or farther than what is measured; None if it is not."""
        off_m = self.body_m - self.measured_m
        if abs(off_m) <= _DOUBTFUL * self.allowed_m:
            return None
        return (
            f"the surface of the body is {1e3 * abs(off_m):.0f} mm "
            f"{'farther away' if off_m > 0.0 else 'nearer'} at the start than the cameras measure "
            f"({self.body_m:.3g} m instead of {self.measured_m:.3g} m): the body has another size "
            "than the object, the start is wrong, or so is the calibration; poses are wrong by "
            "as much"
        )


def check_distance(views: Sequence[CaptureView], body: Body) -> DistanceCheck | None:
    """Compare how far a placed body is with what the first cameras that can measure it say.

    `views` are those of one instant. None if no two cameras and no depth image measure it.
    """
    allowed_m = max(_WRONG_M, _WRONG_SHARE * float(body_sides(body).max()))
    for view, twin in [*((view, None) for view in views), *with_twins(views, views)]:
        if not view.has_image:
            continue
        expected = _depths(body, view.camera, view.world_from_camera)
        depth = _measured_depth(view, twin, _outline(expected))
        if depth is None:
            continue
        both = np.isfinite(expected) & np.isfinite(depth) & (depth > 0.0)
        if both.sum() >= _LEAST_RAYS:
            there, here = (float(np.median(one[both])) for one in (expected, depth))
            return DistanceCheck(there, here, allowed_m)
    return None


def _measured_depth(
    view: CaptureView, twin: CaptureView | None, outline: NDArray[np.uint8]
) -> NDArray[np.float32] | None:
    if twin is None:
        return view.depth()
    if not twin.has_image or not outline.any():
        return None
    try:
        return depth_of_pair(view, twin, outline)
    except (CameraError, TargetError):  # they cannot be matched: no conclusion
        return None


def _outline(depths: Floats) -> NDArray[np.uint8]:
    """Return the mask of a body, the hull of the pixels in which its depth is known."""
    import cv2

    rows, columns = np.nonzero(np.isfinite(depths))
    mask = np.zeros(depths.shape, np.uint8)
    if len(rows):
        cv2.fillConvexPoly(mask, cv2.convexHull(np.stack([columns, rows], axis=1)), (255,))
    return mask


def _depths(body: Body, camera: Camera, world_from_camera: Pose) -> Floats:
    """Return the depth of a body's surface at each pixel, (H, W) float64 in metres along z.

    NaN where it is not seen, and beside the rays that are computed.
    """
    width, height = camera.size_px
    depths = np.full((height, width), np.nan)
    step = max(1, round(float(np.sqrt(width * height / _RAYS))))
    columns, rows = np.meshgrid(np.arange(0, width, step), np.arange(0, height, step))
    rays = np.ones((*columns.shape, 3))
    rays[..., 0] = (columns - camera.center_px[0]) / camera.focal_px[0]
    rays[..., 1] = (rows - camera.center_px[1]) / camera.focal_px[1]
    camera_from_body = world_from_camera.inverse() @ body.world_from_object
    nearest = np.full(columns.shape, np.inf)
    for center, radii, rotation in zip(body.centers, body.radii, body.rotations, strict=True):
        own = Pose.from_parts((0.0, 0.0, 0.0), rotation)
        turn = (camera_from_body @ own).matrix()[:3, :3]
        # In units of its radii, along its axes, it is a ball.
        to_ball = turn.T / radii[:, None]
        away = exact.product(to_ball, camera_from_body.transform(center[None])[0])
        ways = exact.product(rays.reshape(-1, 3), to_ball.T)
        a, b = (ways * ways).sum(axis=1), exact.product(ways, away)
        root = b * b - a * (exact.dot(away, away) - 1.0)
        hit = root > 0.0
        found = np.where(hit, (b - np.sqrt(np.where(hit, root, 0.0))) / a, np.inf)
        found = np.where(found > 0.0, found, np.inf).reshape(columns.shape)
        nearest = np.minimum(nearest, found)
    depths[rows, columns] = np.where(np.isfinite(nearest), nearest, np.nan)
    return depths

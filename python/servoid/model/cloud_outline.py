"""The outline of a point cloud that was seen from one viewpoint, as a view with a mask.

Range samples show only where lines of sight meet the object. Those beside its outline meet nothing,
which bounds the object sideways.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import View
from servoid.camera import Camera
from servoid.model.neighbours import nearest, some_of
from servoid.model.range_samples import RangeSamples
from servoid.pose import Pose, exact

_SAME_EYE = 1e-6  # of the largest coordinate: rounding of points in single precision
_WIDEST = 4.0  # tangent of the angle from the axis up to which a cloud is seen from in front of it
_BEHIND = 0.02  # share of samples behind a viewpoint from which it is inside the cloud
_QUERIES = 300
_NEIGHBOUR = 4  # whose distance is the spacing: as in a grid, about the root of a sample's area
_MOST_SPACINGS = 0.75  # quantile: where the surface faces the eye, samples are sparsest
_CLOSING = 2.0  # spacings: among thousands of random samples, few gaps have a larger radius
_MARGIN = 0.25  # spacings from the last samples to the outline
_SPACING_PX = 3.0
_LEAST_PX, _MOST_PX = 64, 512  # of the cloud's longer side


@dataclass(frozen=True, eq=False)
class Outlook:
    """A cloud in the image of a camera at its viewpoint, whose axis points at its middle.

    `image_points` is (N, 2) float64, in units of the focal length, `depths` (N,) float64, along the
    axis; `spacing` is that of neighbouring samples in the image.
    """

    world_from_camera: Pose
    image_points: NDArray[np.float64]
    depths: NDArray[np.float64]
    spacing: float


def viewpoint_of(samples: RangeSamples) -> NDArray[np.float64] | None:
    """Return the viewpoint, (3,), from which all samples were seen; None if there is not one."""
    if not len(samples):
        return None
    eyes = samples.points - samples.directions
    most = _SAME_EYE * max(float(np.abs(samples.points).max()), float(np.abs(eyes).max()))
    return eyes[0] if float(np.abs(eyes - eyes[0]).max()) <= most else None


def is_around(samples: RangeSamples) -> bool:
    """Return whether samples lie on all sides of the viewpoint from which they were seen."""
    units = samples.directions / exact.lengths(samples.directions)[:, None]
    return float(((units * units.mean(axis=0)).sum(axis=1) <= 0.0).mean()) > _BEHIND


def outlook(samples: RangeSamples, eye: NDArray[np.float64]) -> Outlook | None:
    """Return a cloud as it is seen from its viewpoint; None if it lies around the viewpoint."""
    units = samples.directions / exact.lengths(samples.directions)[:, None]
    axis = units.mean(axis=0)
    if exact.norm(axis) == 0.0:
        return None
    axis = axis / exact.norm(axis)
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side = side / exact.norm(side)
    turn = np.stack([side, np.cross(axis, side), axis], axis=1).astype(np.float64)
    in_camera = exact.product(samples.points - eye, turn)
    depths = in_camera[:, 2]
    if depths.min() <= 0.0:
        return None
    image_points = in_camera[:, :2] / depths[:, None]
    if float(np.abs(image_points).max()) > _WIDEST:
        return None
    queries = some_of(len(depths), _QUERIES)
    _, ways = nearest(image_points, queries, _NEIGHBOUR)
    spacing = float(np.quantile(ways[:, -1], _MOST_SPACINGS))
    if not spacing > 0.0:
        return None
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, eye
    return Outlook(Pose(matrix), image_points, depths, spacing)


def outline_view(seen: Outlook) -> View:
    """Return the view of a cloud from its viewpoint, with the outline of its samples as the mask.

    Gaps between samples are closed. So are holes, in which the object may only not have been
    measured.
    """
    low, high = seen.image_points.min(axis=0), seen.image_points.max(axis=0)
    longest = float((high - low).max())
    pixel = min(max(seen.spacing / _SPACING_PX, longest / _MOST_PX), longest / _LEAST_PX)
    closing = _CLOSING * seen.spacing / pixel
    border = int(closing) + 3
    size = np.ceil((high - low) / pixel).astype(np.int64) + 2 * border
    start = 0.5 * (low + high) - 0.5 * (size - 1) * pixel
    cells = np.rint((seen.image_points - start) / pixel).astype(np.int64)
    drawn = np.zeros((int(size[1]), int(size[0])), np.uint8)
    drawn[cells[:, 1], cells[:, 0]] = 1
    mask = _filled(_closed(drawn, closing, _MARGIN * seen.spacing / pixel))
    camera = Camera(
        size_px=(int(size[0]), int(size[1])),
        focal_px=(1.0 / pixel, 1.0 / pixel),
        center_px=(-start[0] / pixel, -start[1] / pixel),
    )
    return View(camera=camera, world_from_camera=seen.world_from_camera, mask=255 * mask)


def _closed(drawn: NDArray[np.uint8], radius: float, margin: float) -> NDArray[np.uint8]:
    """Close gaps up to a radius between pixels that are drawn, and add a margin around them."""
    wide = (_distances(1 - drawn) <= radius).astype(np.uint8)
    return (_distances(wide) > max(radius - margin, 0.0)).astype(np.uint8)


def _distances(inside: NDArray[np.uint8]) -> NDArray[np.float64]:
    import cv2

    distance = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # OpenCV's last bits depend on its number of threads; the squares of true distances are whole.
    return np.sqrt(np.rint(np.square(distance.astype(np.float64))))


def _filled(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    import cv2

    _, parts = cv2.connectedComponents(1 - mask, connectivity=4)
    return (parts != parts[0, 0]).astype(np.uint8)

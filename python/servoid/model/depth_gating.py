"""Excludes by depth what cannot be the object: pixels far before or behind the range samples."""

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.model.finding import depth_by_stereo
from servoid.model.range_samples import RangeSamples
from servoid.pose import exact

_MARGIN = 1.0  # around the samples, as a share of their width: an object is as deep as wide
_LEAST_SHARE = 0.1  # of the nearest sample's depth, a lower bound for the margin
_WRONG = 0.02  # share of samples that may be wrong, at either end
_BORDER_PX = 5  # error of a measured depth edge; specks that are no wider are errors
_GRID_PX = 4  # spacing of the pixels that are projected into the other view
_DEPTHS = 24  # number of depths at which they are projected

Mask = NDArray[np.uint8]


def gate_by_depth(
    view: CaptureView,
    image: NDArray[np.uint8],
    twin: CaptureView | None,
    samples: RangeSamples,
    region: Mask,
) -> NDArray[np.bool_]:
    """Find the pixels of a region that show something clearly before or behind the object.

    The object's depth range is that of its range samples, extended on both sides by their width. A
    pixel shows something else if its depth is outside that range, by the view's own depth image or
    by stereo with the twin, or if it projects outside the twin's mask at every depth of the object.

    Args:
        view: a view without a mask.
        image: (H, W, 3) uint8, the view's image.
        twin: a view of the same instant that has a mask, or None.
        samples: range samples of the object.
        region: (H, W) uint8, non-zero in the pixels to classify.

    Returns:
        (H, W) bool; False everywhere if no depth is known.

    Raises:
        CaptureError, ImageError, MaskError: a file cannot be used.

    """
    import cv2

    away = np.zeros(region.shape, bool)
    if not len(samples):
        return away
    nearest, farthest = _range(view, samples)
    depth = _depth(view, image, twin, region)
    if depth is not None:
        with np.errstate(invalid="ignore"):
            apart = ((depth < nearest) | (depth > farthest)) & (region != 0)
        kernel = np.ones((2 * _BORDER_PX + 1,) * 2, np.uint8)
        away |= np.asarray(cv2.erode(apart.astype(np.uint8), kernel)) != 0
    if twin is not None:
        away |= (region != 0) & ~_held(view, twin, nearest, farthest)
    return away


def _range(view: CaptureView, samples: RangeSamples) -> tuple[float, float]:
    """Return the range of depths in a view between which the object lies."""
    points = view.world_from_camera.inverse().transform(samples.points)
    low, high = np.quantile(points, (_WRONG, 1.0 - _WRONG), axis=0)
    margin = _MARGIN * exact.norm((high - low)[:2])
    return max(float(low[2]) - margin, _LEAST_SHARE * float(low[2])), float(high[2]) + margin


def _depth(
    view: CaptureView, image: NDArray[np.uint8], twin: CaptureView | None, region: Mask
) -> NDArray[np.float32] | None:
    """Return the depth in a region of a view, NaN where unknown; None if it cannot be measured."""
    depth = view.depth()
    if depth is not None:
        return np.where(depth > 0.0, depth, np.float32(np.nan)).astype(np.float32)
    return None if twin is None else depth_by_stereo(view, image, twin, region)


def _held(
    view: CaptureView, twin: CaptureView, nearest: float, farthest: float
) -> NDArray[np.bool_]:
    """Return the pixels that project into the twin's mask or out of its image at some depth.

    Only a grid of pixels is projected, so that some more pixels are True.
    """
    import cv2

    width, height = view.camera.size_px
    kernel = np.ones((2 * _GRID_PX + 1,) * 2, np.uint8)
    mask = np.asarray(cv2.dilate(twin.mask(), kernel)) != 0
    rows, columns = np.mgrid[0:height:_GRID_PX, 0:width:_GRID_PX]
    rays = np.ones((rows.size, 3))
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    rays[:, :2] = (pixels - np.array(view.camera.center_px)) / np.array(view.camera.focal_px)
    there_from_here = twin.world_from_camera.inverse() @ view.world_from_camera
    held = np.zeros(rows.size, np.uint8)
    for depth in 1.0 / np.linspace(1.0 / nearest, 1.0 / farthest, _DEPTHS):
        found = np.rint(twin.camera.project(there_from_here.transform(depth * rays)))
        inside = ((found >= 0) & (found < twin.camera.size_px)).all(axis=1)
        u, v = found[inside].astype(np.intp).T
        held[~inside] = 1
        held[inside] |= mask[v, u]
    grid = cv2.dilate(held.reshape(rows.shape), np.ones((3, 3), np.uint8))
    full = cv2.resize(grid, (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(full) != 0

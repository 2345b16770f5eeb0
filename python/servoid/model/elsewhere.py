"""Tells what cannot be the object from its depth: what lies far before or behind the seen points."""

import numpy as np
from numpy.typing import NDArray

from servoid.errors import CameraError, TargetError
from servoid.model.sights import Sights
from servoid.observe import CaptureView, rough_depth

_MARGIN = 0.5  # around the seen points, as a share of how wide they are
_WRONG = 0.02  # share of seen points that may be wrong, at either end
_SPECK_PX = 5  # what is smaller is an error of the matching


def elsewhere(
    view: CaptureView,
    image: NDArray[np.uint8],
    twin: CaptureView | None,
    sights: Sights,
    region: NDArray[np.uint8],
) -> NDArray[np.bool_]:
    """Find the pixels of a region that show something clearly before or behind the object.

    The object is as deep as its seen points and a margin that grows with its size. Depth comes
    from the view's own depth image, or is measured with `twin`, another view of the same instant.

    Args:
        view: a view that does not say where the object is.
        image: (H, W, 3) uint8, what it shows.
        twin: another view, or None.
        sights: seen points of the object.
        region: (H, W) uint8, non-zero where it is asked.

    Returns:
        (H, W) bool; False everywhere if nothing is known of the depth.

    """
    import cv2

    nothing = np.zeros(region.shape, bool)
    if not len(sights):
        return nothing
    depth = _depth(view, image, twin, region)
    if depth is None:
        return nothing
    points = view.world_from_camera.inverse().transform(sights.points)
    low, high = np.quantile(points, (_WRONG, 1.0 - _WRONG), axis=0)
    margin = _MARGIN * float(np.linalg.norm((high - low)[:2]))
    with np.errstate(invalid="ignore"):
        away = (depth < low[2] - margin) | (depth > high[2] + margin)
    kernel = np.ones((_SPECK_PX, _SPECK_PX), np.uint8)
    opened = cv2.morphologyEx((away & (region != 0)).astype(np.uint8), cv2.MORPH_OPEN, kernel)
    return np.asarray(opened) != 0


def _depth(
    view: CaptureView,
    image: NDArray[np.uint8],
    twin: CaptureView | None,
    region: NDArray[np.uint8],
) -> NDArray[np.float32] | None:
    """Give the depth in a region of a view, NaN where it is open; None if it cannot be measured."""
    depth = view.depth()
    if depth is not None:
        return np.where(depth > 0.0, depth, np.float32(np.nan)).astype(np.float32)
    if twin is None:
        return None
    here_from_there = view.world_from_camera.inverse() @ twin.world_from_camera
    try:
        return rough_depth(
            image, twin.image(), view.camera, twin.camera, here_from_there, mask_a=region
        )
    except (CameraError, TargetError):
        return None

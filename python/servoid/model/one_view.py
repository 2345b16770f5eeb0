"""Models an object from a single image and the distance of the object."""

import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.config import distance_fault
from servoid.errors import ModelError
from servoid.model.fit import Request, fit_views
from servoid.model.range_samples import (
    NO_RANGE_SAMPLES,
    RangeSamples,
    join_range_samples,
    range_samples_of_depth,
)
from servoid.model.result import Coverage, ModelResult


def fit_one_view(view: CaptureView, distance_m: float, request: Request) -> ModelResult:
    """Model the object of one image, assuming that it is as thick as its outline is wide.

    `distance_m` is the distance of the object's middle from the camera, along the camera's axis.

    Raises:
        ModelError: the distance is not positive or not plausible, or a setting is out of range.
        CameraError, ImageError, MaskError: a file cannot be used.

    """
    start = time.perf_counter()
    fault = distance_fault("the distance", distance_m)
    if fault is not None:
        raise ModelError(fault)
    result = fit_views([view], [], range_samples_of_outline(view, distance_m), request, start=start)
    note = (
        f"one image shows no depth: the object is taken to be {distance_m:g} m away and as thick "
        "as its outline is wide"
    )
    # The assumed thickness was not observed.
    coverage = Coverage.of(result.body, result.native_used, NO_RANGE_SAMPLES)
    return replace(
        result, range_samples=NO_RANGE_SAMPLES, coverage=coverage, notes=(*result.notes, note)
    )


def range_samples_of_outline(view: CaptureView, distance_m: float) -> RangeSamples:
    """Construct an assumed surface, front and back, with the outline of a view's mask.

    The assumed object is a union of balls, one in each maximal disc inside the outline. Their
    centres lie on a plane across the camera's axis.
    """
    mask, camera = view.mask(), view.camera
    focal_px = math.sqrt(camera.focal_px[0] * camera.focal_px[1])
    reach = half_thickness_px(mask) * (distance_m / focal_px)
    pose = view.world_from_camera
    eye = np.array(pose.translation)
    front = range_samples_of_depth((distance_m - reach).astype(np.float32), mask, camera, pose)
    back = range_samples_of_depth((distance_m + reach).astype(np.float32), mask, camera, pose)
    return join_range_samples([front, RangeSamples(back.points, eye - back.points)])


def half_thickness_px(mask: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return how far the balls in an outline extend towards the camera, (H, W), in pixels.

    `mask` is (H, W) uint8, non-zero on the object; the result is 0 elsewhere.
    """
    import cv2

    inside = (np.pad(mask, 1) != 0).astype(np.uint8)
    distance = cv2.distanceTransform(inside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # OpenCV's last bits depend on its number of threads; the squares of true distances are
    # integers.
    radius = np.sqrt(np.rint(np.square(distance.astype(np.float64))))
    # A disc is maximal if no neighbour's disc is larger by at least the distance to it.
    largest = (inside > 0) & (radius > cv2.dilate(radius, np.ones((3, 3))) - 0.6)
    reach_squared = np.zeros_like(radius)
    for row, column in np.argwhere(largest).tolist():
        _raise_ball(reach_squared, row, column, float(radius[row, column]))
    return np.sqrt(reach_squared)[1:-1, 1:-1] * (mask != 0)


def _raise_ball(reach_squared: NDArray[np.float64], row: int, column: int, radius: float) -> None:
    """Add a ball to the union: keep the maximum of the squared extents."""
    size = int(radius)
    rows = np.arange(max(row - size, 0), min(row + size + 1, reach_squared.shape[0]))
    columns = np.arange(max(column - size, 0), min(column + size + 1, reach_squared.shape[1]))
    ball = radius * radius - np.square(rows - row)[:, None] - np.square(columns - column)[None]
    window = reach_squared[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    np.maximum(window, ball, out=window)

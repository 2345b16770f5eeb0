"""Measures the depth around a box in a view: by its depth image, or by stereo."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid.camera.ideal import needs_object
from servoid.capture import CaptureView
from servoid.errors import CameraError, ImageError, TargetError
from servoid.segment import BoxTarget, Depth, Target
from servoid.segment.boxes import pixels_in, window_around
from servoid.stereo import rough_depth


def seen_depth(
    target: Target, view: CaptureView, image: NDArray[np.uint8], views: Sequence[CaptureView]
) -> Depth | None:
    """Measure the depth of the pixels of a recorded image that matter for a target.

    A depth image has them all. Without one, a box is measured by stereo with another camera's view
    of the same instant, if the lens has no distortion.

    Args:
        target: the target, in the pixels of the recorded image.
        view: the view that it is meant for.
        image: (H, W, 3) uint8, its recorded image.
        views: views that may be of the same instant.

    Raises:
        CaptureError, ImageError: the view's depth image cannot be used.

    """
    metres = view.recorded_depth()
    if metres is not None:
        return Depth(metres, view.lens.focal_px[0])
    if not isinstance(target, BoxTarget) or not _is_pinhole(view):
        return None
    inside = pixels_in(target.corners, image.shape)
    if not inside.any() or inside.all():
        return None
    window = window_around(target.corners, image.shape)
    region = np.zeros(image.shape[:2], np.uint8)
    region[window.rows, window.columns] = 255
    for twin in views:
        if twin.index == view.index and twin.camera_name != view.camera_name:
            metres = _by_stereo(view, image, twin, region)
            if metres is not None:
                return Depth(metres, view.lens.focal_px[0])
    return None


def _is_pinhole(view: CaptureView) -> bool:
    """Return whether the recorded pixels of a view are those of its ideal pinhole camera."""
    return not needs_object(view.lens) and view.ideal.maps().map_px is None


def depth_by_stereo(
    view: CaptureView, image: NDArray[np.uint8], twin: CaptureView, region: NDArray[np.uint8]
) -> NDArray[np.float32] | None:
    """Return the depth in a region of a view, NaN where unknown; None if it cannot be measured.

    Args:
        view: the view.
        image: (H, W, 3) uint8, its image.
        twin: another view of the same instant.
        region: (H, W) uint8, non-zero in the pixels to measure.

    Raises:
        CaptureError, ImageError: the twin's image cannot be used.

    """
    here_from_there = view.world_from_camera.inverse() @ twin.world_from_camera
    try:
        return rough_depth(
            image, twin.image(), view.camera, twin.camera, here_from_there, mask_a=region
        )
    except (CameraError, TargetError):
        return None


def _by_stereo(
    view: CaptureView, image: NDArray[np.uint8], twin: CaptureView, region: NDArray[np.uint8]
) -> NDArray[np.float32] | None:
    """Do the same without an error; None also if the twin's image needs the object's place."""
    if needs_object(twin.lens):
        return None
    try:
        return depth_by_stereo(view, image, twin, region)
    except ImageError:  # then colours alone find the object
        return None

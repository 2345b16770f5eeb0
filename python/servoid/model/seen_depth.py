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
    if not isinstance(target, BoxTarget) or needs_object(view.lens):
        return None
    if view.ideal.maps().map_px is not None:
        return None
    box = (target.u0, target.v0, target.u1, target.v1)
    inside = pixels_in(box, image.shape)
    if not inside.any() or inside.all():
        return None
    window = window_around(box, image.shape)
    region = np.zeros(image.shape[:2], np.uint8)
    region[window.rows, window.columns] = 255
    for twin in views:
        if twin.index != view.index or twin.camera_name == view.camera_name:
            continue
        if needs_object(twin.lens):
            continue
        here_from_there = view.world_from_camera.inverse() @ twin.world_from_camera
        try:
            found = rough_depth(
                image, twin.image(), view.camera, twin.camera, here_from_there, mask_a=region
            )
        except (CameraError, ImageError, TargetError):  # the object is marked by colours alone
            continue
        return Depth(found, view.lens.focal_px[0])
    return None

"""Finds what a target means in a view, by depth where an image or stereo measures it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from servoid.camera import needs_object
from servoid.capture import CaptureView
from servoid.errors import CameraError, ImageError, TargetError
from servoid.segment import (
    BoxTarget,
    Depth,
    Found,
    Target,
    find_with_doubts,
    pixels_in,
    window_around,
)
from servoid.stereo import rough_depth


def find_in_view(
    target: Target, view: CaptureView, image: NDArray[np.uint8], views: Sequence[CaptureView]
) -> Found:
    """Find what a target means in the recorded image of a view, by the depth around it as well.

    A depth image has all of it. Without one, a box is measured by stereo with another camera's view
    of the same instant, if the lens has no distortion. A note reports what cannot be measured.

    Args:
        target: the target, in the pixels of the recorded image.
        view: the view that it is meant for.
        image: (H, W, 3) uint8, its recorded image.
        views: views that may be of the same instant.

    Raises:
        TargetError: nothing is found.
        CaptureError, ImageError: the view's depth image cannot be used.

    """
    notes: list[str] = []
    depth = _seen_depth(target, view, image, views, notes)
    found = find_with_doubts(target, image, depth, bits=view.picture.bits)
    if found.doubt is not None:  # which depth might have settled
        return replace(found, doubt="; ".join((found.doubt, *notes)))
    return replace(found, notes=(*notes, *found.notes))


def _seen_depth(
    target: Target,
    view: CaptureView,
    image: NDArray[np.uint8],
    views: Sequence[CaptureView],
    notes: list[str],
) -> Depth | None:
    """Measure the depth of the pixels that matter for a target; note why it cannot be measured."""
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
        # A lens whose rectified image needs the object's place cannot be used before it is found.
        is_twin = twin.index == view.index and twin.camera_name != view.camera_name
        if not is_twin or needs_object(twin.lens):
            continue
        try:
            metres = depth_by_stereo(view, image, twin, region)
        except ImageError as error:
            notes.append(f"no depth from {view.name} and {twin.name}: {error}")
            continue
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

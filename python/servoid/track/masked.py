"""Finds the masks of each camera, and the poses at which a body fits them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose, View, poses_from_masks
from servoid.capture import Capture, CaptureView
from servoid.source import Instant, cameras_of
from servoid.track.request import Subject

Masks = tuple[NDArray[np.uint8] | None, ...]
"""A mask for each pinhole camera of a capture, None where there is none."""


def poses_at_masks(
    capture: Capture, instant: Instant, subject: Subject, masks: Masks | None, seed: int | None
) -> list[Pose]:
    """Find all poses at which a body fits its masks, if there are any, the best one first."""
    seen = zip(
        cameras_of(capture),
        instant.world_from_camera,
        masks or (None,) * len(instant.images),
        instant.images,
        strict=True,
    )
    marked = [
        (View(camera=camera, world_from_camera=world_from_camera, mask=mask), image)
        for camera, world_from_camera, mask, image in seen
        if mask is not None and mask.any() and image is not None
    ]
    if not marked or subject.body is None:
        return []
    views, images = (list(parts) for parts in zip(*marked, strict=True))
    found = poses_from_masks(subject.body, views, images, subject.colors, seed or 0)
    return [world_from_object for world_from_object, _ in found]


def masks_of(capture: Capture, views: Sequence[CaptureView]) -> Masks:
    """Return a mask for each pinhole camera, None where no view has one."""
    found: dict[str, NDArray[np.uint8]] = {}
    ideals = {camera.name: camera.ideal for camera in capture.cameras}
    for view in views:
        ideal = ideals[view.camera_name]
        if view.given_mask is None:
            found[view.camera_name] = replace(view, shared=ideal).mask()
        elif view.ideal is ideal:
            found[view.camera_name] = view.given_mask
    return tuple(found.get(camera.name) for camera in capture.cameras)

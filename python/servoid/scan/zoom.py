"""Compares the focal lengths of the first and the second half of a scan's images."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from servoid.scan.adjusting import adjust, deviation_px, intrinsic_covariances
from servoid.scan.running import pycolmap

_LEAST_IMAGES = 8  # of both halves together
_APART = 0.02  # share by which the focal lengths of one lens do not differ
_SURE = 5.0  # standard deviations of a difference that is none by chance


def zoomed_px(model: Any, files: Sequence[str]) -> tuple[float, float] | None:
    """Return the focal lengths of both halves of the images, if they surely differ, else None.

    `files` are the names of the images in their order. A zoom that changed is absorbed by poses
    and points, so that the reprojection errors with one focal length for all hardly tell it.
    """
    seen = {model.image(number).name: number for number in model.reg_image_ids()}
    numbers = [seen[name] for name in files if name in seen]
    if len(numbers) < _LEAST_IMAGES:
        return None
    halved = _halved(model, numbers)
    adjuster = adjust(halved, center=False, bent=False)
    covariances = intrinsic_covariances(halved, adjuster)
    if not covariances:
        return None
    first, second = (float(halved.camera(number).params[0]) for number in (1, 2))
    deviation = float(np.sqrt(sum(float(one[0, 0]) for one in covariances)))
    sure = _SURE * deviation_px(halved) * deviation
    apart = abs(first - second)
    return (first, second) if apart > max(_APART * min(first, second), sure) else None


def _halved(model: Any, numbers: list[int]) -> Any:
    """Return a copy of a model whose images have two cameras, one for each half."""
    colmap = pycolmap()
    (camera,) = model.cameras.values()
    halved = colmap.Reconstruction()
    for number in (1, 2):
        one = colmap.Camera(
            camera_id=number,
            model=camera.model,
            width=camera.width,
            height=camera.height,
            params=camera.params,
        )
        halved.add_camera_with_trivial_rig(one)
    for place, number in enumerate(numbers):
        image = model.image(number)
        half = 1 + 2 * place // len(numbers)
        xy = np.array([point.xy for point in image.points2D]).reshape(-1, 2)
        copy = colmap.Image(name=image.name, keypoints=xy, camera_id=half, image_id=number)
        halved.add_image_with_trivial_frame(copy, image.cam_from_world())
    for number, point in model.points3D.items():
        track = colmap.Track(list(point.track.elements))
        halved.add_point3D_with_id(number, colmap.Point3D(xyz=point.xyz, track=track))
    return halved

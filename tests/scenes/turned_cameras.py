"""Recordings and images of cameras that were turned, or whose images were changed."""

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.capture import ArrayPicture, Capture, CaptureCamera
from servoid.pose import Pose

Image = NDArray[np.uint8]
Change = Callable[[Image, CaptureCamera, int], Image]
"""Changes an image of a camera, by the number of its observation."""


def changed(capture: Capture, count: int, change: Change, step: int = 1) -> Capture:
    """Return so many observations, every `step`-th, whose images are changed; without depth."""
    places = [place * step for place in range(count)]
    cameras = []
    for camera in capture.cameras:
        pictures = []
        for number, place in enumerate(places):
            picture = camera.pictures[place]
            assert picture is not None
            pixels = change(picture.read(camera.lens.size_px), camera, number)
            pictures.append(ArrayPicture(path=capture.path, label=str(number), pixels=pixels))
        cameras.append(
            replace(
                camera,
                pictures=tuple(pictures),
                mask_paths=tuple(camera.mask_paths[place] for place in places),
                depth_paths=(None,) * count,
                depths_m=(),
            )
        )
    poses = tuple(capture.world_from_rig[place] for place in places)
    return replace(capture, cameras=tuple(cameras), world_from_rig=poses, times_s=None)


def turned(
    image: Image, degrees: float, focal_px: float, border: int = cv2.BORDER_REPLICATE
) -> Image:
    """Return what a camera sees once it has turned about its vertical axis."""
    height, width = image.shape[:2]
    matrix = np.array(
        [[focal_px, 0.0, (width - 1) / 2], [0.0, focal_px, (height - 1) / 2], [0.0, 0.0, 1.0]]
    )
    turn = Pose.exp([0.0, 0.0, 0.0, 0.0, np.radians(degrees), 0.0]).matrix()[:3, :3]
    change = matrix @ turn @ np.linalg.inv(matrix)
    moved = cv2.warpPerspective(image, change, (width, height), borderMode=border)
    return np.asarray(moved, np.uint8)

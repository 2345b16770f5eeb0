"""Models by the paper's own method: hue windows, points, and a plain genetic algorithm."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, PaperSettings, Pose, Step, View, fit_paper
from servoid.errors import MaskError, ModelError, located
from servoid.model.running import ProgressCallback, run_core
from servoid.segment import LEAST_SATURATION, LEAST_VALUE, hue_window, match_image

__all__ = ["fit_paper_views", "hue_window", "match_image"]


def fit_paper_views(
    images: Sequence[NDArray[np.uint8]],
    cameras: Sequence[Camera],
    world_from_cameras: Sequence[Pose],
    window: tuple[float, float],
    *,
    settings: PaperSettings | None = None,
    least_saturation: float = LEAST_SATURATION,
    least_value: float = LEAST_VALUE,
    progress: ProgressCallback | None = None,
) -> list[Step]:
    """Model the object of a given hue in images, (H, W, 3) uint8 RGB, each with camera and pose.

    `window` is (low, high) in degrees, as `hue_window` returns it. The result has one step for each
    count of ellipsoids. `progress` is called on the caller's thread after each generation. An
    exception that it raises, or Ctrl-C, stops the work and propagates to the caller.

    Raises:
        ModelError: the lists differ in length, the views have no common point, or a setting is out
            of its range.
        ImageError, MaskError: an image cannot be used, or no pixel of it has the hue.

    """
    counts = (len(images), len(cameras), len(world_from_cameras))
    if len(set(counts)) != 1:
        raise ModelError(
            "each image needs its camera and pose, but there are {} images, {} cameras and {} "
            "poses".format(*counts)
        )
    views: list[View] = []
    for index, image in enumerate(images):
        with located(f"image {index}"):
            match = match_image(image, *window, least_saturation, least_value)
            if not match.any():
                raise MaskError(
                    f"no pixel falls into the hue window of {window[0]:.0f} to {window[1]:.0f} "
                    "degrees; choose a window around the target's hue, or leave this image out"
                )
            pose = world_from_cameras[index]
            views.append(View(camera=cameras[index], world_from_camera=pose, mask=match))
    chosen = PaperSettings() if settings is None else settings
    return run_core(lambda report: fit_paper(views, chosen, report), progress)

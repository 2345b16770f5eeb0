"""Exposure control: a camera that slowly restores the initial brightness of its images."""

import numpy as np

from servoid._native import Lens
from servoid.pose import exact
from servoid.sim.world.cameras.renderer import Image, Renderer, Shot

_ACROSS_PX = 24  # size of the image that is metered
_STRONGEST = 8.0  # maximum factor of the exposure


class Metering:
    """Meters each exposure of one camera, whether its image is rendered or not.

    The first exposure counts as correct, as the camera has settled before. From then on the mean
    light on the sensor returns to that of the first image, with a time constant.
    """

    def __init__(self, lens: Lens, period_s: float, time_constant_s: float) -> None:
        self._lens = _small(lens)
        self._share = -exact.expm1(-period_s / time_constant_s)
        self._wanted: float | None = None
        self.gain = 1.0

    @property
    def lens(self) -> Lens:
        """Return the lens of the small image that is metered."""
        return self._lens

    def meter(self, renderer: Renderer, shot: Shot) -> float:
        """Return the gain of this exposure, which `shot` renders, and update that of the next."""
        gain = self.gain
        light = brightness(renderer.image(shot))
        if self._wanted is None:
            self._wanted = light
        factor = 1.0 + self._share * (self._wanted / light - 1.0)
        self.gain: float = min(max(gain * factor, 1.0 / _STRONGEST), _STRONGEST)
        return gain


def brightness(image: Image) -> float:
    """Return the mean light of an image (H, W, 3), from 0 to 1; grey levels are its square root."""
    levels = image.astype(np.int64)
    # Integer sums are the same on every machine.
    return max(int((levels * levels).sum()), 1) / (levels.size * 255.0 * 255.0)


def _small(lens: Lens) -> Lens:
    """Return a pinhole camera with a lens's field of view, in few pixels."""
    scale = _ACROSS_PX / lens.size_px[0]
    width, height = _ACROSS_PX, max(1, round(scale * lens.size_px[1]))
    return Lens(
        model="pinhole",
        size_px=(width, height),
        focal_px=(scale * lens.focal_px[0], scale * lens.focal_px[1]),
        center_px=(0.5 * (width - 1), 0.5 * (height - 1)),
    )

"""Decodes sRGB, in which images and colours are stored."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from servoid.pose import exact


def linear_light(srgb: ArrayLike) -> NDArray[np.float64]:
    """Convert sRGB channels of any shape to linear light, both 0 to 1 (IEC 61966-2-1)."""
    channels = np.asarray(srgb, np.float64)
    different, places = np.unique(channels, return_inverse=True)
    linear = [
        one / 12.92 if one <= 0.04045 else exact.power((one + 0.055) / 1.055, 2.4)
        for one in different.tolist()
    ]
    return np.array(linear, np.float64)[places].reshape(channels.shape)

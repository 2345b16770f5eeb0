"""Simulates the error of a person who marks an object in an image."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats

_WAVE_PX = 12.0  # correlation length along a hand-drawn outline
_HAND = 0x4A4D  # separates this random stream from others of the same seed


def hand_drawn(mask: NDArray[np.uint8], px: float, seed: int) -> NDArray[np.uint8]:
    """Return a mask (H, W) with a distorted outline, as a hand draws it.

    The standard deviation of the distortion is `px` along each axis of the image.
    """
    if px == 0.0:
        return mask
    height, width = mask.shape
    random = np.random.default_rng((_HAND, seed))
    u, v = (px * _waves(random, height, width) for _ in range(2))
    rows, columns = np.indices(mask.shape)
    rows = np.clip(np.rint(rows + v), 0, height - 1).astype(np.intp)
    columns = np.clip(np.rint(columns + u), 0, width - 1).astype(np.intp)
    return mask[rows, columns]


def hand_missed(count: int, px: float, seed: int) -> Floats:
    """Return errors (N,) in pixels of coordinates that a person clicks."""
    return px * np.random.default_rng((_HAND, seed, 1)).normal(size=count)


def _waves(random: np.random.Generator, height: int, width: int) -> Floats:
    """Return smooth noise (H, W) of standard deviation 1: coarse samples, interpolated."""
    v, u = np.arange(height) / _WAVE_PX, np.arange(width) / _WAVE_PX
    coarse = random.normal(size=(int(v[-1]) + 2, int(u[-1]) + 2))
    i, j = v.astype(np.intp), u.astype(np.intp)
    down, along = _shares(v - i)[:, :, None], _shares(u - j)[:, None, :]
    corners = (coarse[i + a][:, j + b] for a in (0, 1) for b in (0, 1))
    weights = (down[a] * along[b] for a in (0, 1) for b in (0, 1))
    return np.sum([one * share for one, share in zip(corners, weights, strict=True)], axis=0)


def _shares(after: Floats) -> Floats:
    """Return the interpolation weights (2, N) of two neighbours that preserve the variance."""
    length = np.sqrt(np.square(1.0 - after) + np.square(after))
    return np.stack([(1.0 - after) / length, after / length])

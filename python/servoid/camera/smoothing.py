"""Smooths arrays of floating-point numbers, with the same bits on every processor.

OpenCV's own filter uses fused multiply-add where the processor has it, which rounds differently.
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from servoid.pose import exact

_REACH = 4.0  # standard deviations; samples beyond have no weight
_BLOCK = 20_000  # numbers at a time, which fit in the cache

Real = TypeVar("Real", np.float32, np.float64)


def gaussian(values: NDArray[Real], sigma_px: float) -> NDArray[Real]:
    """Average (H, W) or (H, W, C) with Gaussian weights; the image is mirrored at its edges."""
    if values.size == 0:
        return values.copy()
    weights = _weights(sigma_px)
    return _along(_along(values, weights, 1), weights, 0)


def _weights(sigma_px: float) -> NDArray[np.float64]:
    """Return the weights (R + 1,) of the centre and one side; those of both sides sum to 1."""
    away = np.arange(round(_REACH * sigma_px) + 1) / sigma_px
    weights = exact.exp(-0.5 * away * away)
    return weights / (2.0 * weights[1:].sum() + weights[0])


def _along(values: NDArray[Real], weights: NDArray[np.float64], axis: int) -> NDArray[Real]:
    """Average along the rows, axis 1, or the columns, axis 0."""
    reach = len(weights) - 1
    border = [(reach, reach) if other == axis else (0, 0) for other in range(values.ndim)]
    wide = np.pad(values, border, mode="reflect")
    first, *others = weights.astype(values.dtype)
    found = np.empty_like(values)
    rows = max(1, _BLOCK * len(values) // values.size)
    for start in range(0, len(values), rows):
        total = found[start : start + rows]
        around = wide[start : start + rows + (0 if axis else 2 * reach)]
        shifted = _windows(around, total.shape[axis], axis)
        np.multiply(shifted[reach], first, out=total)
        for away, weight in enumerate(others, start=1):
            total += weight * (shifted[reach - away] + shifted[reach + away])
    return found


def _windows(wide: NDArray[Real], size: int, axis: int) -> list[NDArray[Real]]:
    """Return all windows of a size along an axis, from the first to the last."""
    starts = range(wide.shape[axis] - size + 1)
    return [wide[:, one : one + size] if axis else wide[one : one + size] for one in starts]

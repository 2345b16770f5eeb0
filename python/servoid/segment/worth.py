"""Scores a cut of an image by its border, its colours and its shape."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import exact
from servoid.segment.segment import Image, Mask

_BINS = 16
_CELLS = _BINS * _BINS * _BINS


def log_ratio(small: Image, inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the log ratio of each pixel's colour frequency inside to that outside, in nats."""
    import cv2

    bins = np.asarray(cv2.cvtColor(small, cv2.COLOR_RGB2LAB)).astype(np.intp) * _BINS // 256
    index = (bins[..., 0] * _BINS + bins[..., 1]) * _BINS + bins[..., 2]
    shares = []
    for pixels in (inside, ~inside):
        counts = np.bincount(index[pixels], minlength=_CELLS).astype(np.float64)
        counts = counts.reshape(_BINS, _BINS, _BINS)
        for axis in range(3):
            counts = _spread(counts, axis)
        shares.append(counts.ravel() / counts.sum())
    rare = 0.2 / _CELLS  # frequency assigned to a colour that was never seen
    return exact.log((shares[0] + rare) / (shares[1] + rare))[index].astype(np.float32)


def _spread(counts: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Smooth counts over neighbouring bins with weights 1, 2, 1."""
    padded = np.pad(counts, [(1, 1) if other == axis else (0, 0) for other in range(3)], "edge")
    low, middle, high = (
        np.take(padded, np.arange(counts.shape[axis]) + shift, axis) for shift in (0, 1, 2)
    )
    return 0.25 * low + 0.5 * middle + 0.25 * high


def edges_of(small: Image) -> NDArray[np.float32]:
    """Return the colour gradient at each pixel; 1 is the strength that a fifth exceed."""
    import cv2

    smooth = np.asarray(cv2.GaussianBlur(small, (0, 0), 0.7)).astype(np.float32)
    across, down = (np.asarray(cv2.Sobel(smooth, -1, *way)) for way in ((1, 0), (0, 1)))
    strength = np.sqrt((across * across + down * down).sum(axis=2))
    return (strength / max(1.0, float(np.quantile(strength, 0.8)))).astype(np.float32)


def border_on_edges(mask: Mask, edges: NDArray[np.float32]) -> float:
    """Return how well a mask's border lies on edges of the image, from 0 to 1."""
    import cv2

    border = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((2, 2), np.uint8))) > 0
    return (
        float(np.median(edges[border])) / (1.5 + float(np.median(edges[border])))
        if border.any()
        else 0.0
    )


def colors_agree(small: Image, mask: Mask) -> float:
    """Return the share of all pixels that are on the side where their colour is more frequent."""
    taken = mask != 0
    if not taken.any() or taken.all():
        return 0.0
    return float(((log_ratio(small, taken) > 0.0) == taken).mean())


def solidity(mask: Mask) -> float:
    """Return the share of its convex hull that a mask fills: low for scattered patches."""
    import cv2

    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return 0.0
    hull = np.zeros_like(mask)
    cv2.fillConvexPoly(hull, cv2.convexHull(np.concatenate(outlines)), (255,))
    return float((mask != 0).sum()) / float((hull != 0).sum())

"""Finds the object that a box surrounds or a click names: several cuts, of which the best stays."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from servoid.observe.segment import (
    CERTAIN,
    MAYBE,
    MAYBE_NOT,
    NOT,
    ROUNDS,
    Image,
    Mask,
    Window,
    cut,
    refine_border,
)
from servoid.observe.smoothing import gaussian
from servoid.pose import exact

_BINS = 16
_CELLS = _BINS * _BINS * _BINS
_LATER_STARTS = 1.0 / 1.5  # the plain start is left only for one that is clearly better
_GOOD_ENOUGH = 0.8
_CLICK_RADII = (0.06, 0.09, 0.13, 0.19, 0.28, 0.4, 0.55, 0.8)
_CLICK_SIDE_PX = 96
_CERTAIN_SHARE = 0.12
_LIKELY_SHARE = 0.5
_RIM_SHARE = 0.02  # of the image, taken for background: an object is seen whole


def grow_from_box(image: Image, box: Mask) -> Mask:
    """Find the object in a box: `box` is a mask of its pixels; the answer may be empty.

    GrabCut starts from all pixels of the box, from those whose colours are rarer around it, and
    from those of them that are surest; the cut stays that best fills the box and lies on edges.
    """
    best, best_worth = None, 0.0
    for longest_px, margin in ((128, 0.1), (128, 0.25), (256, 0.1)):
        window = Window.around(box, longest_px, margin)
        small, inside = window.small(image), window.small(box) > 127
        if inside.all() or not inside.any():
            continue
        edges = _edges(small)
        handicap = 1.0
        for labels in _starts(small, inside):
            mask = cut(small, labels, ROUNDS)
            worth = _border_on_edges(mask, edges) * _tightness(mask, inside)
            worth *= handicap / (1.05 - _colors_agree(small, mask))
            if worth > best_worth:
                best, best_worth = (window, mask), worth
            handicap = _LATER_STARTS
        if best_worth > _GOOD_ENOUGH:
            break
    if best is None:
        return np.zeros(box.shape, np.uint8)
    mask = refine_border(image, *best)
    return np.where(box != 0, mask, 0).astype(np.uint8)


def grow_from_click(image: Image, u: float, v: float) -> Mask:
    """Find the object at the pixel (u, v); the answer may be empty.

    GrabCut starts from discs around the click, from small ones to most of the image. The cut stays
    whose border lies on edges, whose colours differ from those around it, and which the disc
    before found as well; of two that are as good, the larger.
    """
    height, width = image.shape[:2]
    rows, columns = np.ogrid[:height, :width]
    distance = exact.hypot(rows - v, columns - u)
    before: Mask = np.zeros((height, width), np.uint8)
    best, best_worth = None, 0.0
    for share in _CLICK_RADII:
        radius = share * max(height, width)
        window, small, mask, offered = _cut_disc(image, distance, radius)
        full = window.full(mask, image.shape)
        agreement = np.sqrt(0.2 + _overlap(full, before))
        worth = _click_worth(small, mask, offered) * exact.power(share, 0.3) * agreement
        if worth > best_worth:
            best, best_worth = (window, mask), worth
        before = full
    return before * 0 if best is None else refine_border(image, *best)


def _cut_disc(
    image: Image, distance: NDArray[np.float64], radius: float
) -> tuple[Window, Image, Mask, NDArray[np.bool_]]:
    """Cut an object in a disc; return the part that holds the click, and the disc."""
    inner = np.zeros(distance.shape, bool)
    rim = max(2, round(_RIM_SHARE * max(distance.shape)))
    inner[rim:-rim, rim:-rim] = True

    def disc(share: float) -> Mask:
        inside = (distance <= max(2.0, share * radius)) & (inner | (distance <= 2.0))
        return np.where(inside, 255, 0).astype(np.uint8)

    window = Window.around(disc(1.0), _CLICK_SIDE_PX, 0.15)
    small = window.small(image)
    possible, likely, certain = (
        window.small(disc(share)) > 127 for share in (1.0, _LIKELY_SHARE, _CERTAIN_SHARE)
    )
    labels = np.where(possible, np.where(likely, MAYBE, MAYBE_NOT), NOT)
    mask = cut(small, np.where(certain, CERTAIN, labels).astype(np.uint8), ROUNDS)
    return window, small, part_with(mask, certain), possible


def part_with(mask: Mask, seeds: NDArray[np.bool_]) -> Mask:
    """Keep the connected part of a mask that holds most of the seeds."""
    import cv2

    labels = np.asarray(cv2.connectedComponents(mask, connectivity=4)[1])
    held = labels[seeds & (labels > 0)]
    if not held.size:
        return np.zeros_like(mask)
    return np.where(labels == np.bincount(held).argmax(), 255, 0).astype(np.uint8)


def _click_worth(small: Image, mask: Mask, offered: NDArray[np.bool_]) -> float:
    import cv2

    if float((mask != 0).sum()) > 0.85 * float(offered.sum()):
        return 0.0
    rim = offered & ~(np.asarray(cv2.erode(offered.astype(np.uint8), np.ones((3, 3)))) > 0)
    cut_off = float((mask[rim] != 0).mean()) if rim.any() else 0.0
    worth = _border_on_edges(mask, _edges(small)) / (1.05 - _colors_agree(small, mask))
    return worth * (1.0 - cut_off)


def _overlap(one: Mask, other: Mask) -> float:
    """Measure the intersection over union of two masks; 0 if both are empty."""
    union = int(((one != 0) | (other != 0)).sum())
    return int(((one != 0) & (other != 0)).sum()) / union if union else 0.0


def _starts(small: Image, inside: NDArray[np.bool_]) -> Iterator[NDArray[np.uint8]]:
    """Yield labels to start from, between which only their success can decide."""
    ratio = gaussian(_log_ratio(small, inside), 1.0)
    yield np.where(inside, MAYBE, NOT).astype(np.uint8)
    for level in (0.0, max(0.0, float(np.median(ratio[inside])))):
        likely = inside & (ratio > level)
        yield np.where(inside, np.where(likely, MAYBE, MAYBE_NOT), NOT).astype(np.uint8)
    sure = inside & (ratio > max(0.5, float(np.quantile(ratio[inside], 0.85))))
    labels = np.where(inside, np.where(ratio > 0.0, MAYBE, MAYBE_NOT), NOT)
    yield np.where(sure, CERTAIN, labels).astype(np.uint8)


def _log_ratio(small: Image, inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Say how much more frequent each pixel's colour is inside than outside, in nats."""
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
    rare = 0.2 / _CELLS  # what a colour that was never seen is worth
    return exact.log((shares[0] + rare) / (shares[1] + rare))[index].astype(np.float32)


def _spread(counts: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Spread counts over the neighbouring bins, 1 to 2 to 1."""
    padded = np.pad(counts, [(1, 1) if other == axis else (0, 0) for other in range(3)], "edge")
    low, middle, high = (
        np.take(padded, np.arange(counts.shape[axis]) + shift, axis) for shift in (0, 1, 2)
    )
    return 0.25 * low + 0.5 * middle + 0.25 * high


def _edges(small: Image) -> NDArray[np.float32]:
    """Measure how fast colour changes at each pixel; 1 is the strength that a fifth exceed."""
    import cv2

    smooth = np.asarray(cv2.GaussianBlur(small, (0, 0), 0.7)).astype(np.float32)
    across, down = (np.asarray(cv2.Sobel(smooth, -1, *way)) for way in ((1, 0), (0, 1)))
    strength = np.sqrt((across * across + down * down).sum(axis=2))
    return (strength / max(1.0, float(np.quantile(strength, 0.8)))).astype(np.float32)


def _border_on_edges(mask: Mask, edges: NDArray[np.float32]) -> float:
    """Say how well a mask's border lies on edges of the image, from 0 to 1."""
    import cv2

    border = np.asarray(cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((2, 2), np.uint8))) > 0
    return (
        float(np.median(edges[border])) / (1.5 + float(np.median(edges[border])))
        if border.any()
        else 0.0
    )


def _colors_agree(small: Image, mask: Mask) -> float:
    """Say which share of all pixels is on the side where its colour is more frequent."""
    taken = mask != 0
    if not taken.any() or taken.all():
        return 0.0
    return float(((_log_ratio(small, taken) > 0.0) == taken).mean())


def _tightness(mask: Mask, inside: NDArray[np.bool_]) -> float:
    """Say how nearly a mask reaches all four sides of its box, without being all of it."""
    if not mask.any():
        return 0.0
    gaps = 0.0
    for axis in (0, 1):
        taken, offered = (np.flatnonzero(px.any(axis=axis))[[0, -1]] for px in (mask, inside))
        gaps += float(np.abs(taken - offered).sum()) / float(offered[1] - offered[0] + 1)
    share = float((mask != 0).sum()) / float(inside.sum())
    return exact.exp(-3.0 * gaps) * (1.0 if share < 0.95 else 0.5)

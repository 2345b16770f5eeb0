"""Finds the object in a box by depth, where a gap in depth separates it from all around it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.segment.answers import overlap
from servoid.segment.doubts import Depth, far_sides
from servoid.segment.segment import Image, Mask, Window, color_lines

_MIDDLES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)  # quantiles of the depth in a box
_HALF_DEPTHS = (0.5, 0.75)  # of an object, as shares of its box's longer side
_GAP = 0.15  # of the box's longer side: a smaller step in depth is no gap
_ALIKE = 0.9  # overlap of two layers that are the same
_CONTINUED = 0.1  # share of a layer's border at which its surface may continue
_BEYOND = 0.03  # share of a layer that may be outside the box
_FAR_SIDE = 0.25  # of a box's width or height, at which a layer does not fill it
_LEAST_KNOWN = 0.6  # share of the pixels in a box, and around it, that must have a depth
_BORDER_PX = 3  # error of an edge in a depth image, in pixels of the small image
_ROUNDS, _SIDE_PX = 6, 9  # how often a border is moved to an edge, and how far at most
_FARTHER = np.float32(1e6)  # metres: than anything that is measured

Bools = NDArray[np.bool_]
Metres = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class SmallDepth:
    """The depth of a small image's pixels, NaN where unknown, and the width of one at 1 m."""

    metres: Metres
    px_at_1m: float

    @classmethod
    def of(cls, depth: Depth, window: Window) -> "SmallDepth":
        """Return the depth in a window; a small pixel has the depth of the nearest one."""
        import cv2

        part = np.ascontiguousarray(depth.metres[window.rows, window.columns])
        small = np.asarray(cv2.resize(part, window.small_px, interpolation=cv2.INTER_NEAREST))
        metres = np.where(small > 0.0, small, np.float32(np.nan)).astype(np.float32)
        return cls(metres, part.shape[1] / window.small_px[0] / depth.focal_px)


def cut_by_depth(small: Image, depth: SmallDepth, drawn: Bools, possible: Bools) -> Mask | None:
    """Cut out the only layer in a box that a gap in depth separates from all around it.

    Colours decide only where its border is exactly: edges of depth images are not exact.

    Args:
        small: (H, W, 3) uint8, RGB.
        depth: the depth of its pixels.
        drawn: (H, W) bool, the pixels of the box.
        possible: (H, W) bool, the pixels that the object may cover.

    Returns:
        (H, W) uint8, 255 on the object; None if there is no such layer or several, or if the depth
        of too many pixels is unknown.

    """
    layer = _only_layer(depth, drawn, possible)
    if layer is None:
        return None
    # Guided filter (He and Sun), repeated: each round moves the border towards an edge nearby.
    guide = (small / np.float32(255.0)).astype(np.float32)
    mask = layer
    for _ in range(_ROUNDS):
        lines = color_lines(guide, (mask != 0).astype(np.float32), side_px=_SIDE_PX)
        soft = (lines[..., :3] * guide).sum(axis=2) + lines[..., 3]
        mask = np.where((soft > 0.5) & possible, 255, 0).astype(np.uint8)
    return mask if mask.any() else None


def _only_layer(depth: SmallDepth, drawn: Bools, possible: Bools) -> Mask | None:
    known = np.isfinite(depth.metres)
    if min(float(known[drawn].mean()), float(known[~possible].mean())) < _LEAST_KNOWN:
        return None
    found: Mask | None = None
    for middle in np.quantile(depth.metres[drawn & known], _MIDDLES).tolist():
        layer = _layer_at(middle, depth, drawn, possible)
        if layer is not None and found is not None and overlap(found, layer) < _ALIKE:
            return None
        found = layer if found is None else found
    return found


def _layer_at(middle: float, depth: SmallDepth, drawn: Bools, possible: Bools) -> Mask | None:
    """Return the layer of an object around a depth, None if it is not apart from its surroundings.

    It is apart if it is the same for a deeper object, fills the box, hardly extends beyond it, and
    has a gap in depth all along its border.
    """
    rows, columns = (np.flatnonzero(drawn.any(axis=axis)) for axis in (1, 0))
    box = (columns[0], rows[0], columns[-1], rows[-1])
    side = max(len(rows), len(columns)) * depth.px_at_1m * middle
    gap, beyond = _GAP * side, ~_dilated(possible, _BORDER_PX)
    wholes: list[Bools] = []
    for share in _HALF_DEPTHS:
        near = np.abs(depth.metres - middle) <= share * side
        core = _largest_in(drawn, near & ~_steps(depth.metres, gap))
        whole = near & _continued(core, depth.metres, gap)
        if not whole.any() or (whole & beyond).sum() > _BEYOND * whole.sum():
            return None
        wholes.append(whole)
    layer, deeper = (np.where(whole & possible, 255, 0).astype(np.uint8) for whole in wholes)
    ring = _dilated(wholes[0], 2) & ~wholes[0]
    goes_on = ring & _continued(wholes[0], depth.metres, gap)
    if overlap(layer, deeper) < _ALIKE or goes_on.sum() > _CONTINUED * ring.sum():
        return None
    if not layer.any() or far_sides(layer, box, _FAR_SIDE):
        return None
    return _filled(layer, ~np.isfinite(depth.metres) & possible)


def _filled(layer: Mask, unknown: Bools) -> Mask:
    """Return a layer with those pixels of unknown depth that it encloses."""
    import cv2

    outlines, _ = cv2.findContours(layer, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    whole = np.asarray(cv2.drawContours(layer.copy(), outlines, -1, (255,), cv2.FILLED))
    return np.where((layer != 0) | ((whole != 0) & unknown), 255, 0).astype(np.uint8)


def _largest_in(drawn: Bools, inside: Bools) -> Bools:
    """Return the connected component that has the most pixels in the box."""
    import cv2

    count, found = cv2.connectedComponents(inside.astype(np.uint8), connectivity=4)
    labels = np.asarray(found)
    sizes = np.bincount(labels[drawn & inside], minlength=count)
    return inside & (labels == int(np.argmax(sizes)))


def _steps(metres: Metres, gap: float) -> Bools:
    """Return the pixels next to which the depth changes by more than a gap."""
    nearest, farthest = _range_around(metres, np.isfinite(metres), 1)
    return farthest - nearest > gap


def _continued(layer: Bools, metres: Metres, gap: float) -> Bools:
    """Return the pixels of a layer and those up to 2 px beyond it, up to where there is a gap."""
    nearest, farthest = _range_around(metres, layer, 2)
    return (metres < farthest + gap) & (metres > nearest - gap)


def _range_around(metres: Metres, chosen: Bools, reach_px: int) -> tuple[Metres, Metres]:
    """Return the least and the largest depth of the chosen pixels around each pixel."""
    import cv2

    kernel = np.ones((2 * reach_px + 1,) * 2, np.uint8)
    low = np.where(chosen, metres, _FARTHER).astype(np.float32)
    high = np.where(chosen, metres, np.float32(0.0)).astype(np.float32)
    nearest, farthest = cv2.erode(low, kernel), cv2.dilate(high, kernel)
    return np.asarray(nearest, np.float32), np.asarray(farthest, np.float32)


def _dilated(pixels: Bools, by_px: int) -> Bools:
    import cv2

    kernel = np.ones((2 * by_px + 1,) * 2, np.uint8)
    return np.asarray(cv2.dilate(pixels.astype(np.uint8), kernel)) != 0

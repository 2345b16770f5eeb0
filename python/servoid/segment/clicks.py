"""Finds the object at a click: cuts in discs around it, and around moved clicks."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import exact
from servoid.segment.answers import HAND_PX, Answers, overlap
from servoid.segment.segment import CERTAIN, MAYBE, MAYBE_NOT, NOT, Image, Mask, Window, cut
from servoid.segment.worth import border_on_edges, colors_agree, edges_of

_RADII = (0.06, 0.09, 0.13, 0.19, 0.28, 0.4, 0.55, 0.8)
_LONGEST_PX = 400  # of the small image in which clicks are processed
_SIDE_PX = 80
_ROUNDS = 3
_CERTAIN_SHARE = 0.12
_LIKELY_SHARE = 0.5
_RIM_SHARE = 0.02  # of the image, assumed to be background: the object is fully visible
_MOVES = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


def grow_from_click(image: Image, u: float, v: float) -> Answers:
    """Find the object at the pixel (u, v), and at pixels a hand's error away; may be empty.

    GrabCut starts from discs around the click, from small ones to most of the image. The best cut
    has its border on edges and colours that differ from those around it, and the previous disc
    found it as well; of two equally good cuts, the larger one is used.
    """
    window = Window.whole(image.shape, _LONGEST_PX)
    small = window.small(image)
    shrink = window.small_px[0] / image.shape[1]
    found = []
    for across, down in _MOVES:
        at = (u + HAND_PX * across, v + HAND_PX * down)
        found.append(_grown(small, *(shrink * (place + 0.5) - 0.5 for place in at)))
    return Answers.of(window, found)


def _grown(image: Image, u: float, v: float) -> Mask:
    height, width = image.shape[:2]
    rows, columns = np.ogrid[:height, :width]
    distance = exact.hypot(rows - v, columns - u)
    before: Mask = np.zeros((height, width), np.uint8)
    best, best_worth = before, 0.0
    for share in _RADII:
        radius = share * max(height, width)
        window, small, mask, offered = _cut_disc(image, distance, radius)
        full = window.full(mask, image.shape)
        shared = overlap(full, before) if full.any() else 0.0
        worth = _worth(small, mask, offered) * exact.power(share, 0.3) * np.sqrt(0.2 + shared)
        if worth > best_worth:
            best, best_worth = full, worth
        before = full
    return best


def _cut_disc(
    image: Image, distance: NDArray[np.float64], radius: float
) -> tuple[Window, Image, Mask, NDArray[np.bool_]]:
    """Cut an object in a disc; return the part that contains the click, and the disc."""
    inner = np.zeros(distance.shape, bool)
    rim = max(2, round(_RIM_SHARE * max(distance.shape)))
    inner[rim:-rim, rim:-rim] = True
    # A click that was moved out of the image uses the nearest pixel.
    near = distance <= max(2.0, float(distance.min()))

    def disc(share: float) -> Mask:
        inside = ((distance <= share * radius) & inner) | near
        return np.where(inside, 255, 0).astype(np.uint8)

    window = Window.around(disc(1.0), _SIDE_PX, 0.15)
    small = window.small(image)
    possible, likely, certain = (
        window.small(disc(share)) > 127 for share in (1.0, _LIKELY_SHARE, _CERTAIN_SHARE)
    )
    labels = np.where(possible, np.where(likely, MAYBE, MAYBE_NOT), NOT)
    mask = cut(small, np.where(certain, CERTAIN, labels).astype(np.uint8), _ROUNDS)
    return window, small, _part_with(mask, certain), possible


def _part_with(mask: Mask, seeds: NDArray[np.bool_]) -> Mask:
    """Keep the connected component of a mask that contains most of the seeds."""
    import cv2

    labels = np.asarray(cv2.connectedComponents(mask, connectivity=4)[1])
    held = labels[seeds & (labels > 0)]
    if not held.size:
        return np.zeros_like(mask)
    return np.where(labels == np.bincount(held).argmax(), 255, 0).astype(np.uint8)


def _worth(small: Image, mask: Mask, offered: NDArray[np.bool_]) -> float:
    import cv2

    if float((mask != 0).sum()) > 0.85 * float(offered.sum()):
        return 0.0
    rim = offered & ~(np.asarray(cv2.erode(offered.astype(np.uint8), np.ones((3, 3)))) > 0)
    cut_off = float((mask[rim] != 0).mean()) if rim.any() else 0.0
    worth = border_on_edges(mask, edges_of(small)) / (1.05 - colors_agree(small, mask))
    return worth * (1.0 - cut_off)

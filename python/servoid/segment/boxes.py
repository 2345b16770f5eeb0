"""Finds the object in a box: cuts from several starts, for the box and for moved copies."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.camera import gaussian
from servoid.pose import exact
from servoid.segment.answers import HAND_PX, Answers
from servoid.segment.doubts import Depth, far_sides
from servoid.segment.layers import SmallDepth, cut_by_depth
from servoid.segment.segment import CERTAIN, MAYBE, MAYBE_NOT, NOT, Image, Mask, Window, cut
from servoid.segment.worth import border_on_edges, colors_agree, edges_of, log_ratio, solidity

Corners = tuple[float, float, float, float]

_SIDE_PX = 96
_MARGIN = 0.2
_ROUNDS = 3
# For each start: the plain one is replaced only by one that is clearly better.
_HANDICAPS = (1.0, 0.4, 1.0 / 1.5, 1.0 / 1.5)
_CORE = 0.7  # share of the box's sides; most objects fill the core of a tight box
# Displacements of the corners, in units of a hand's error: none, larger, smaller, and shifted.
_MOVES = (
    (0.0, 0.0, 0.0, 0.0),
    (-1.0, -1.0, 1.0, 1.0),
    (1.0, 1.0, -1.0, -1.0),
    (1.0, 1.0, 1.0, 1.0),
    (-1.0, -1.0, -1.0, -1.0),
    (1.0, -1.0, 1.0, -1.0),
    (-1.0, 1.0, -1.0, 1.0),
)


def larger(box: Corners) -> Corners:
    """Return a box with its sides moved outward by a hand's error."""
    return _moved(box, _MOVES[1])


def pixels_in(box: Corners, shape: tuple[int, ...]) -> Mask:
    """Return the pixels of a box (left, top, right, bottom), (H, W) uint8: 255 inside."""
    rows, columns = np.arange(shape[0]), np.arange(shape[1])
    inside = ((rows >= box[1] - 0.5) & (rows <= box[3] + 0.5))[:, None] & (
        (columns >= box[0] - 0.5) & (columns <= box[2] + 0.5)
    )
    return np.where(inside, 255, 0).astype(np.uint8)


def window_around(box: Corners, shape: tuple[int, ...]) -> Window:
    """Return the part of an image of a shape (H, W, ...) that is examined for a box."""
    return Window.around(pixels_in(larger(larger(box)), shape), _SIDE_PX, _MARGIN)


def grow_from_box(image: Image, box: Corners, depth: Depth | None = None) -> Answers:
    """Find the object in a box, and in copies of the box moved by a hand's error; may be empty.

    The object may extend beyond a box by a hand's error. Where depth separates one layer in each
    box from all around it, this is the object. Otherwise, of the cuts in a box, the best fills the
    box, has its border on edges, has colours that are rare around it, and is compact.
    """
    boxes = [_moved(box, by) for by in _MOVES]
    window = window_around(box, image.shape)
    small = window.small(image)
    if depth is not None:
        layered = _by_depth(small, window, boxes, image.shape, depth)
        if layered is not None:
            return layered
    edges = edges_of(small)
    chosen: list[Mask] = []
    weighed: list[tuple[float, Mask]] = []
    for one in boxes:
        offer = _Offer.of(one, window, image.shape)
        if offer is None:
            continue
        cuts = [cut(small, labels, _ROUNDS) for labels in _starts(small, offer)]
        pairs = zip(_HANDICAPS, cuts, strict=True)
        worths = [share * _worth(small, mask, edges, offer) for share, mask in pairs]
        best = int(np.argmax(worths))
        chosen.append(cuts[best] if worths[best] > 0.0 else np.zeros_like(cuts[best]))
        weighed += zip(worths, cuts, strict=True)
    return Answers.of(window, chosen or [np.zeros(small.shape[:2], np.uint8)], weighed)


def _by_depth(
    small: Image, window: Window, boxes: list[Corners], shape: tuple[int, ...], depth: Depth
) -> Answers | None:
    """Return the layers that depth separates in boxes, of which the user drew the first.

    None if there is a box in which it separates none.
    """
    seen = SmallDepth.of(depth, window)
    masks: list[Mask] = []
    for box in boxes:
        offer = _Offer.of(box, window, shape)
        mask = None if offer is None else cut_by_depth(small, seen, offer.drawn, offer.possible)
        if mask is None:
            return None
        masks.append(mask)
    answers = Answers.of(window, masks, has_rough_border=False)
    mask = window.full(answers.mask, shape)
    # A layer that does not fill the box may be a part of the object, or something before it.
    return answers if mask.any() and not far_sides(mask, boxes[0]) else None


@dataclass(frozen=True, eq=False)
class _Offer:
    """The pixels of a box in the small image: all, its core, and those the object may cover."""

    drawn: NDArray[np.bool_]
    core: NDArray[np.bool_]
    possible: NDArray[np.bool_]

    @classmethod
    def of(cls, box: Corners, window: Window, shape: tuple[int, ...]) -> "_Offer | None":
        """Return the pixels of a box; None if the object may be nowhere or everywhere."""
        aside = 0.5 * (1.0 - _CORE)
        width, height = box[2] - box[0], box[3] - box[1]
        core = (
            box[0] + aside * width,
            box[1] + aside * height,
            box[2] - aside * width,
            box[3] - aside * height,
        )
        drawn, core, possible = (
            window.small(pixels_in(one, shape)) > 127 for one in (box, core, larger(box))
        )
        possible = drawn if possible.all() else possible
        return None if drawn.all() or not drawn.any() else cls(drawn, core, possible)


def _moved(box: Corners, by: Corners) -> Corners:
    left, top, right, bottom = (side + HAND_PX * way for side, way in zip(box, by, strict=True))
    if left >= right:  # a box smaller than a hand's error collapses to its centre
        left = right = 0.5 * (left + right)
    if top >= bottom:
        top = bottom = 0.5 * (top + bottom)
    return left, top, right, bottom


def _starts(small: Image, offer: _Offer) -> Iterator[NDArray[np.uint8]]:
    """Yield labels to start from; only their results can decide between them."""
    possible = offer.possible
    yield np.where(possible, MAYBE, NOT).astype(np.uint8)
    yield np.where(offer.core, CERTAIN, np.where(possible, MAYBE, NOT)).astype(np.uint8)
    ratio = gaussian(log_ratio(small, possible), 1.0)
    likely = ratio > max(0.0, float(np.median(ratio[possible])))
    yield np.where(possible, np.where(likely, MAYBE, MAYBE_NOT), NOT).astype(np.uint8)
    sure = possible & (ratio > max(0.5, float(np.quantile(ratio[possible], 0.85))))
    labels = np.where(possible, np.where(ratio > 0.0, MAYBE, MAYBE_NOT), NOT)
    yield np.where(sure, CERTAIN, labels).astype(np.uint8)


def _worth(small: Image, mask: Mask, edges: NDArray[np.float32], offer: _Offer) -> float:
    if not mask.any():
        return 0.0
    fits = border_on_edges(mask, edges) * _tightness(mask, offer.drawn) * solidity(mask)
    return fits / (1.05 - colors_agree(small, mask))


def _tightness(mask: Mask, drawn: NDArray[np.bool_]) -> float:
    """Return how nearly a mask reaches all four sides of its box without filling it."""
    gaps = 0.0
    for axis in (0, 1):
        taken, offered = (np.flatnonzero(px.any(axis=axis))[[0, -1]] for px in (mask, drawn))
        gaps += float(np.abs(taken - offered).sum()) / float(offered[1] - offered[0] + 1)
    share = float((mask != 0).sum()) / float(drawn.sum())
    return exact.exp(-3.0 * gaps) * (1.0 if share < 0.95 else 0.5)

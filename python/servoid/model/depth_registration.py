"""Finds depth images that are not registered to the colour images whose masks they should fill.

A mask is placed on the depth image where it is filled by one surface that ends at its border. That
is where it is if both are of one place; elsewhere if the depth image is of another camera, or of
another field of view.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.pose import Floats, exact

NOT_REGISTERED = "the depth image is not registered to the colour image"

_MOST_VIEWS = 3
_POINTS, _BORDER_POINTS = 400, 160  # of a mask that are compared
_REACH = 0.12  # of the image's width, to each side: where the mask is sought
_STEPS = 10  # in which it is, to each side
_FINER = 3  # times the steps are halved
_SCALES = (1.0, 0.67, 0.75, 0.85, 1.18, 1.33, 1.5)  # of the mask, at which it is sought
_SCALED = 0.15  # by which one of another size must be better
_BESIDE = 0.02, 3.0  # of the longer side, and pixels: from the border to what is compared beside it
_INSIDE_PX = 2  # depth at the border mixes object and background
_THICK, _GAP = 0.5, 0.15  # of the object's width: its depth at most, and a step at its border
_LEAST_KNOWN = 0.3  # share of the points with a depth, below which nothing is told
_FILLED = 0.93  # share of a mask's points on one surface, from which on it is in its place
# By how much more of it are on one surface elsewhere, and of its border at a step. Right depth with
# noise and holes, 44 drawn images: 0.11 and 0.14; wrong by 20 px and more: 0.22 and 0.37 or more.
_FULLER, _EDGED = 0.13, 0.22
_SHIFTED, _SIZED = 0.08, 0.12  # of the object's width, and of its size: what is reported
_SURE = 0.15  # of the object's width, or a size: from which on the body is surely wrong
_BLIND = 0.5  # of a step, where nothing is measured beside a surface


@dataclass(frozen=True)
class Misregistered:
    """Where a depth image shows the object of a view's mask: beside it, and in which size."""

    name: str
    shift_px: tuple[float, float]
    scale: float
    width_px: float

    @property
    def is_sure(self) -> bool:
        """Return whether a body of both is surely wrong."""
        off = exact.hypot(*self.shift_px) / self.width_px
        return off > _SURE or _another_size(self.scale) > _SURE

    @property
    def words(self) -> str:
        """Describe it, and what to do."""
        x, y = (round(one) for one in self.shift_px)
        size = "" if abs(self.scale - 1.0) < _SIZED else f" and {self.scale:.2g} times as large"
        return (
            f"{self.name}: the depth image shows the object ({x}, {y}) pixels beside its mask"
            f"{size}: it is not registered to the colour image, so that shape and rotation are "
            "wrong; register it (align depth to colour), or, if it is registered, correct the mask"
        )


def misregistered(views: Iterable[CaptureView]) -> Misregistered | None:
    """Find that the depth images of views are not registered to their masks, in most of three."""
    seen = [view for view in views if view.has_depth and view.has_mask]
    if not seen:
        return None
    chosen = np.unique(np.linspace(0, len(seen) - 1, _MOST_VIEWS).round())
    told = [_compare(seen[int(number)]) for number in chosen]
    found = [one for one in told if one is not None]
    return found[0] if 2 * len(found) > len(told) else None


@dataclass(frozen=True)
class _Fit:
    """How a mask fits at a place: shares of its points on one surface, and at steps."""

    filled: float
    edged: float
    shift: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0

    @property
    def score(self) -> float:
        return self.filled + self.edged - (_SCALED if self.scale != 1.0 else 0.0)


@dataclass(frozen=True, eq=False)
class _Mask:
    """Points (N, 2) of a mask beside its middle: some inside, and those on both sides of a border.

    `ways` (M, 2) lead from points of the border to what is beside it.
    """

    inside: Floats
    border: Floats
    ways: Floats
    middle: Floats
    width_px: float

    @classmethod
    def of(cls, mask: NDArray[np.uint8]) -> "_Mask | None":
        """Choose points; None if the mask is too small, or cut off by the image."""
        import cv2

        pixels = (mask != 0).astype(np.uint8)
        rows, columns = np.nonzero(pixels)
        if len(rows) < _POINTS:
            return None
        away = max(_BESIDE[0] * max(np.ptp(rows), np.ptp(columns)), _BESIDE[1])
        soft = cv2.GaussianBlur(pixels.astype(np.float32), (0, 0), away)
        slopes = (cv2.Sobel(soft, cv2.CV_32F, 1, 0), cv2.Sobel(soft, cv2.CV_32F, 0, 1))
        outlines, _ = cv2.findContours(pixels, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        border = _evenly(np.concatenate([np.asarray(one)[:, 0] for one in outlines]))
        size = np.array(mask.shape[::-1])
        border = border[((border > away + 1.0) & (border < size - away - 2.0)).all(axis=1)]
        if 2 * len(border) < _BORDER_POINTS:
            return None
        ways = -np.stack([np.asarray(one)[border[:, 1], border[:, 0]] for one in slopes], axis=1)
        ways = away * ways / np.maximum(exact.lengths(ways), 1e-9)[:, None]
        kernel = np.ones((2 * _INSIDE_PX + 1,) * 2, np.uint8)
        rows, columns = np.nonzero(np.asarray(cv2.erode(pixels, kernel)))
        some = np.random.default_rng(0).permutation(len(rows))[:_POINTS]
        inside = np.stack([columns[some], rows[some]], axis=1).astype(np.float64)
        if not len(inside):
            return None
        middle = inside.mean(axis=0)
        width_px = float(np.sqrt(pixels.sum()))
        return cls(inside - middle, border - middle, ways, middle, width_px)


def _evenly(points: NDArray[np.int32]) -> NDArray[np.int32]:
    places = np.linspace(0, len(points) - 1, min(len(points), _BORDER_POINTS)).astype(int)
    return points[places]


def _compare(view: CaptureView) -> Misregistered | None:
    depth, mask = view.depth(), _Mask.of(view.mask())
    if depth is None or mask is None:
        return None
    metres = np.where(np.isfinite(depth) & (depth > 0.0), depth, 0.0).astype(np.float64)
    focal_px = view.camera.focal_px[0]
    here = _fits(mask, metres, focal_px, [(0.0, 0.0)], 1.0)[0]
    if here.filled >= _FILLED:
        return None
    best = _best(mask, metres, focal_px, here)
    if best.filled < here.filled + _FULLER or best.edged < here.edged + _EDGED:
        return None
    off = exact.hypot(*best.shift)
    if off < _SHIFTED * mask.width_px and _another_size(best.scale) < _SIZED:
        return None
    by = view.recorded.by
    shift = (best.shift[0] * by, best.shift[1] * by)
    return Misregistered(view.name, shift, best.scale, mask.width_px * by)


def _another_size(scale: float) -> float:
    """Return how far from 1 a scale is, the same for twice and half the size."""
    return max(scale, 1.0 / scale) - 1.0


def _best(mask: _Mask, metres: Floats, focal_px: float, here: _Fit) -> _Fit:
    """Seek the place and the size at which a mask fits best, coarsely and then finely."""
    step = max(2.0, _REACH * metres.shape[1] / _STEPS)
    places = step * np.arange(-_STEPS, _STEPS + 1)
    ways = [(x, y) for y in places.tolist() for x in places.tolist()]
    tried = (one for scale in _SCALES for one in _fits(mask, metres, focal_px, ways, scale))
    best = max((here, *tried), key=lambda one: one.score)
    for _ in range(_FINER):
        step *= 0.5
        (x, y), scale = best.shift, best.scale
        near = [(x + a * step, y + b * step) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        more = _fits(mask, metres, focal_px, near, scale)
        best = max((best, *more), key=lambda one: one.score)
    return best


def _fits(
    mask: _Mask,
    metres: Floats,
    focal_px: float,
    shifts: Sequence[tuple[float, float]],
    scale: float,
) -> list[_Fit]:
    """Return how a mask of another size fits at places beside its own."""
    found = []
    for shift in shifts:
        middle = mask.middle + shift
        inside = _at(metres, middle + scale * mask.inside)
        known = inside > 0.0
        if known.mean() < _LEAST_KNOWN:
            found.append(_Fit(0.0, 0.0, shift, scale))
            continue
        usual = float(np.median(inside[known]))
        width = scale * mask.width_px * usual / focal_px
        border = middle + scale * mask.border
        near, beside = _at(metres, border - mask.ways), _at(metres, border + mask.ways)
        is_on = np.abs(near - usual) < _THICK * width
        steps = np.where(beside == 0.0, _BLIND, beside - near > _GAP * width)
        found.append(
            _Fit(
                float((np.abs(inside - usual) < _THICK * width).mean()),
                float(np.where(is_on, steps, 0.0).mean()),
                shift,
                scale,
            )
        )
    return found


def _at(metres: Floats, points: Floats) -> Floats:
    """Return the depth at points (N, 2); beside the image NaN."""
    columns, rows = np.rint(points).astype(np.int64).T
    height, width = metres.shape
    is_seen = (columns >= 0) & (rows >= 0) & (columns < width) & (rows < height)
    seen = metres[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    return np.where(is_seen, seen, np.nan)

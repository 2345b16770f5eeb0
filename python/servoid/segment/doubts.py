"""Checks a mask for signs of error: a gap in depth, a box that is too far or too near, thinness."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.brief import brief
from servoid.segment.answers import HAND_PX
from servoid.segment.segment import Mask

_BORDER_PX = 2  # depth at the outline mixes object and background
_LEAST_PIXELS = 50  # with depth, below which nothing is reported
_LEAST_SHARE = 0.1  # of a mask's pixels, that form a separate surface
_BETWEEN = 0.02  # share of pixels that may be in a gap, as at edges inside the object
_GAP = 0.5  # of the object's width: parts of one object are nearer to each other
_FAR_SIDE = 0.15  # of a box's width or height
_CUT_PX = HAND_PX - 1.0  # more than this beyond a side of its box, a mask ends where it must
# Of the mask's largest width along that side: boxes around the object reach 0.17 there, those that
# end in its middle mostly 0.21 to 1.
_CUT_SHARE = 0.2
_THIN = 0.5  # share of a mask that must remain after thin parts are removed


@dataclass(frozen=True, eq=False)
class Depth:
    """A depth image, (H, W) float32 in metres, NaN where unknown, and its focal length."""

    metres: NDArray[np.float32]
    focal_px: float

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Parting:
    """Two surfaces in one mask: the masks of the near and the far one, and the gap in metres."""

    near: Mask
    far: Mask
    gap: float
    width: float

    @property
    def words(self) -> str:
        """Describe the gap."""
        near, far = (int((mask != 0).sum()) for mask in (self.near, self.far))
        share = 100.0 * far / (near + far)
        return (
            f"its mask covers two surfaces: by its depth {share:.0f} % of it are "
            f"{self.gap:.2g} m behind the rest, and the rest is only {self.width:.2g} m wide"
        )


def parted_by_depth(mask: Mask, depth: Depth) -> Parting | None:
    """Find a gap in the depth of a mask's pixels that is too wide for one object."""
    import cv2

    kernel = np.ones((2 * _BORDER_PX + 1,) * 2, np.uint8)
    metres = depth.metres
    inside = (cv2.erode(mask, kernel) != 0) & np.isfinite(metres) & (metres > 0.0)
    ordered = np.sort(metres[inside]).astype(np.float64)
    count = len(ordered)
    if count < _LEAST_PIXELS:
        return None
    within = max(1, int(_BETWEEN * count))
    first, last = int(_LEAST_SHARE * count), int((1.0 - _LEAST_SHARE) * count) - within
    if last <= first:
        return None
    gaps = ordered[first + within : last + within] - ordered[first:last]
    widest = int(np.argmax(gaps))
    gap = float(gaps[widest])
    border = ordered[first + widest] + 0.5 * gap
    near, far = (
        np.where(part & (mask != 0), 255, 0).astype(np.uint8)
        for part in (~(metres > border), metres > border)
    )
    # The width of a square that has the area of its nearer part.
    width = float(np.median(ordered[ordered <= border])) * float(
        np.sqrt(float((inside & (metres <= border)).sum()))
    )
    width /= depth.focal_px
    return Parting(near, far, gap, width) if gap > _GAP * width else None


def far_sides(
    mask: Mask, box: tuple[float, float, float, float], most: float = _FAR_SIDE
) -> list[str]:
    """Return the sides of a box (left, top, right, bottom) that a mask does not come near.

    It is near with a gap of at most a share `most` of the box's width or height.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    height, width = mask.shape
    left, top = max(box[0], 0.0), max(box[1], 0.0)
    right, bottom = min(box[2], width - 1.0), min(box[3], height - 1.0)
    gaps = {
        "left": (columns[0] - left) / (right - left + 1.0),
        "top": (rows[0] - top) / (bottom - top + 1.0),
        "right": (right - columns[-1]) / (right - left + 1.0),
        "bottom": (bottom - rows[-1]) / (bottom - top + 1.0),
    }
    return [side for side, gap in gaps.items() if gap > most]


def cut_sides(mask: Mask, box: tuple[float, float, float, float]) -> list[str]:
    """Return the sides of a box (left, top, right, bottom) at which a mask is cut off.

    It is where much of it ends beyond the side, by a hand's error. The image's border cuts none.
    """
    inside = mask != 0
    by_row, by_column = inside.sum(axis=1), inside.sum(axis=0)
    # The pixels inside of each line parallel to a side, the outermost first, and the side's place.
    height, width = mask.shape
    seen_from = {
        "left": (by_column, box[0]),
        "top": (by_row, box[1]),
        "right": (by_column[::-1], width - 1.0 - box[2]),
        "bottom": (by_row[::-1], height - 1.0 - box[3]),
    }
    return [side for side, (lines, at) in seen_from.items() if _is_cut(lines, at)]


def _is_cut(lines: NDArray[np.int64], side: float) -> bool:
    end = int(np.flatnonzero(lines)[0])
    # The outermost line may hold few pixels of a border that was moved.
    wide = lines[end : end + 2].max() > _CUT_SHARE * lines.max()
    return bool(wide) and end > 0 and side - end > _CUT_PX


def thickness_left(mask: Mask) -> float:
    """Return the share of a mask that survives erosion and dilation by a hand's error."""
    import cv2

    side = 2 * round(HAND_PX) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    stays = cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc)
    return float((np.asarray(stays) != 0).sum()) / float((mask != 0).sum())


def is_thin(mask: Mask) -> bool:
    """Return whether a mask is a line rather than an area: moving its border changes it wholly."""
    return thickness_left(mask) < _THIN

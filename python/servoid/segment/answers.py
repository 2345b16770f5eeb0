"""Masks for a target and its moved copies: their consensus, and how far they differ."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.segment.segment import Image, Mask, Window, grow_mask, refine_border

HAND_PX = 3.0
"""The error of a user's box, click or mask, in pixels."""

STEADY = 0.94
"""The least overlap of each answer with the consensus."""

CLEAR = 0.8
"""The least overlap of all possible answers with the consensus, on average."""

_DIFFERENT = 0.9  # overlap below which two answers count as different
_NO_OTHER = 0.9  # overlap above which a sharp mask still matches the rough one
_MOST_SHOWN = 4
_COARSE = 1.5  # border error of a cut, in pixels of the small image


@dataclass(frozen=True, eq=False)
class Answers:
    """The masks for a target and for the same target moved by `HAND_PX`, in the small image.

    `mask` is the consensus of the answers; `masks` are the answers. `clearness` is the overlap of
    all candidate cuts with the consensus, from 0 to 1, weighted by their scores. Unless it
    `has_rough_border`, the border of `mask` is not cut again by the colours of the whole image.
    """

    window: Window
    mask: Mask
    masks: tuple[Mask, ...]
    clearness: float = 1.0
    has_rough_border: bool = True

    @classmethod
    def of(
        cls,
        window: Window,
        masks: Sequence[Mask],
        weighed: Sequence[tuple[float, Mask]] = (),
        *,
        has_rough_border: bool = True,
    ) -> "Answers":
        """Combine answers; `weighed` are all candidate cuts, with their scores."""
        votes = np.sum([mask != 0 for mask in masks], axis=0)
        mask = np.where(2 * votes > len(masks), 255, 0).astype(np.uint8)
        worth = sum(worth for worth, _ in weighed)
        shared = sum(worth * overlap(one, mask) for worth, one in weighed)
        clearness = shared / worth if worth > 0.0 else 1.0
        return cls(window, mask, tuple(masks), clearness, has_rough_border)

    @property
    def steadiness(self) -> float:
        """Return the overlap of the consensus with the answer that differs most."""
        return min(overlap(mask, self.mask) for mask in self.masks)

    def sharp(self, image: Image) -> Mask:
        """Return the mask at the image's size, with its border refined on the image itself."""
        import cv2

        rough = refine_border(image, self.window, self.mask)
        if not self.has_rough_border:
            return rough
        width = self.window.columns.stop - self.window.columns.start
        reach = 2 * round(max(1.0, _COARSE * width / self.window.small_px[0])) + 1
        kernel = np.ones((reach, reach), np.uint8)
        certain, possible = cv2.erode(rough, kernel), cv2.dilate(rough, kernel)
        possible = np.asarray(possible, np.uint8)
        if not rough.any() or (possible != 0).all():
            return rough
        grown = grow_mask(image, np.asarray(certain, np.uint8), possible, likely=rough, rounds=2)
        return grown if overlap(grown, rough) > _NO_OTHER else rough

    def shown(self, shape: tuple[int, ...]) -> tuple[Mask, ...]:
        """Return the answers that differ, at an image's size; the consensus comes first."""
        kept = [self.mask]
        for mask in self.masks:
            if len(kept) < _MOST_SHOWN and all(overlap(mask, one) < _DIFFERENT for one in kept):
                kept.append(mask)
        return tuple(self.window.full(mask, shape) for mask in kept)


def overlap(one: Mask, other: Mask) -> float:
    """Measure the intersection over union of two masks; 1 if both are empty."""
    union = int(((one != 0) | (other != 0)).sum())
    return int(((one != 0) & (other != 0)).sum()) / union if union else 1.0

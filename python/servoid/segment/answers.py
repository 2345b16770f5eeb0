"""Answers to the same question asked several times: what they share, and how far they differ."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.segment.segment import Image, Mask, Window, grow_mask, refine_border

HAND_PX = 3.0
"""By how much a person may miss what is meant with a box, a click or a mask, in pixels."""

STEADY = 0.94
"""The least overlap of each answer with what most of them say."""

CLEAR = 0.8
"""The least overlap of all that may be meant with it, on average."""

_DIFFERENT = 0.9  # overlap below which two answers are shown as two
_NO_OTHER = 0.9  # overlap above which a sharp mask is still the rough one
_MOST_SHOWN = 4
_COARSE = 1.5  # pixels of the small image by which its cut may miss a border


@dataclass(frozen=True, eq=False)
class Answers:
    """What was found for a target and for the same target moved by `HAND_PX`, in the small image.

    `mask` is what most answers say; `masks` are the answers. `clearness` is the overlap of all
    cuts that were weighed with it, from 0 to 1, each counting by its worth.
    """

    window: Window
    mask: Mask
    masks: tuple[Mask, ...]
    clearness: float = 1.0

    @classmethod
    def of(
        cls, window: Window, masks: Sequence[Mask], weighed: Sequence[tuple[float, Mask]] = ()
    ) -> "Answers":
        """Join answers; `weighed` are all cuts that these were chosen from, with their worth."""
        votes = np.sum([mask != 0 for mask in masks], axis=0)
        mask = np.where(2 * votes > len(masks), 255, 0).astype(np.uint8)
        worth = sum(worth for worth, _ in weighed)
        shared = sum(worth * overlap(one, mask) for worth, one in weighed)
        return cls(window, mask, tuple(masks), shared / worth if worth > 0.0 else 1.0)

    @property
    def steadiness(self) -> float:
        """Return the overlap of what most answers say with the answer that differs most."""
        return min(overlap(mask, self.mask) for mask in self.masks)

    def sharp(self, image: Image) -> Mask:
        """Return the mask in the image's size, its border found on the image's own pixels."""
        import cv2

        rough = refine_border(image, self.window, self.mask)
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
        """Return the answers that differ, in an image's size; what most say is the first."""
        kept = [self.mask]
        for mask in self.masks:
            if len(kept) < _MOST_SHOWN and all(overlap(mask, one) < _DIFFERENT for one in kept):
                kept.append(mask)
        return tuple(self.window.full(mask, shape) for mask in kept)


def overlap(one: Mask, other: Mask) -> float:
    """Measure the intersection over union of two masks; 1 if both are empty."""
    union = int(((one != 0) | (other != 0)).sum())
    return int(((one != 0) & (other != 0)).sum()) / union if union else 1.0

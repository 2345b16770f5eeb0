"""Compares features of the object in views with the poses of the views."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView, Features, alike, closest, features_on, of_one_motion
from servoid.errors import ServoidError
from servoid.pose import Floats, exact

_FEATURES = 500
_LONG_PX = 240  # towards which what is within a mask is shrunk
_ASIDE_PX = 8  # of the shrunk image, around that
_LEAST = 15  # features of a pair that are located
_PARALLAX_PX = 2.0  # at 1000 px of diagonal: with less, a place is noise


@dataclass(frozen=True, eq=False)
class Looked:
    """Features of the object in a view.

    `center`, (3,), is that of the camera, and `middle_ray`, (3,), a unit vector from it to the
    middle of the mask, both in the world.
    """

    view: CaptureView
    features: Features
    center: Floats
    middle_ray: Floats

    @property
    def unit_px(self) -> float:
        """Return a thousandth of the diagonal of the image."""
        return exact.hypot(*map(float, self.view.camera.size_px)) / 1000.0


def look(view: CaptureView) -> Looked | None:
    """Find features of the object in a view; None if they are too few, or it cannot be read."""
    try:
        image, mask = view.image(), view.mask()
    except ServoidError:
        return None
    if image.shape[:2] != mask.shape or not mask.any():
        return None
    top, bottom = _ends(mask, axis=1)
    left, right = _ends(mask, axis=0)
    found = _found(image, mask, (top, bottom, left, right))
    if found is None:
        return None
    middle = np.array([[(left + right - 1) / 2.0, (top + bottom - 1) / 2.0]])
    center = np.array(view.world_from_camera.translation)
    return Looked(view, found, center, _rays(view, middle)[0])


def place(seen: Sequence[Looked]) -> Floats:
    """Return where the object is, (3,): nearest to the rays to the middles of its masks."""
    rays = np.array([one.middle_ray for one in seen])
    centers = np.array([one.center for one in seen])
    aside = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    # Rays that are all parallel do not determine it; then it is in the middle of the cameras.
    middle = centers.mean(axis=0)
    right = (aside * (centers - middle)[:, None, :]).sum(axis=(0, 2))
    return middle + exact.solve(aside.sum(axis=0) + 1e-9 * len(seen) * np.eye(3), right)


def off_px(one: Looked, other: Looked) -> float | None:
    """Return by how much rays to features miss each other, at 1000 px of diagonal, at the median.

    What they locate behind a camera is infinitely far off. None if the two have too few features in
    common.
    """
    found = of_one_motion(alike(one.features, other.features), one.unit_px)
    if found is None:
        return None
    rays, others = (_rays(by.view, px) for by, px in zip((one, other), found, strict=True))
    nearest, missed, sines = closest(rays, others, one.center - other.center)
    unit = one.unit_px / one.view.camera.focal_px[0]
    kept = sines > _PARALLAX_PX * unit
    if kept.sum() < _LEAST:
        return None
    nearest, missed = nearest[kept], missed[kept]
    is_ahead = nearest > 0.0
    off = np.where(is_ahead, missed / np.where(is_ahead, nearest, 1.0) / unit, np.inf)
    return float(np.median(off))


def _found(
    image: NDArray[np.uint8], mask: NDArray[np.uint8], box: tuple[int, int, int, int]
) -> Features | None:
    """Find features within a mask, and the box around it, in the pixels of the image.

    That part of the image is shrunk before.
    """
    import cv2

    top, bottom, left, right = box
    by = 1
    while max(bottom - top, right - left) // (2 * by) >= _LONG_PX:
        by *= 2
    aside = by * _ASIDE_PX
    top, left = max(top - aside, 0), max(left - aside, 0)
    part = image[top : bottom + aside, left : right + aside]
    size = (part.shape[1] // by, part.shape[0] // by)
    whole = np.ascontiguousarray(part[: size[1] * by, : size[0] * by])
    grey = cv2.resize(cv2.cvtColor(whole, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
    covered = np.ascontiguousarray(mask[top::by, left::by][: size[1], : size[0]])
    found = features_on(np.asarray(grey, np.uint8), covered, _FEATURES)
    return found and ((found[0] + 0.5) * by - 0.5 + np.array([left, top]), found[1])


def _ends(mask: NDArray[np.uint8], axis: int) -> tuple[int, int]:
    """Return the first place of a mask across an axis, and that after the last."""
    places = np.flatnonzero(mask.any(axis=axis))
    return int(places[0]), int(places[-1]) + 1


def _rays(view: CaptureView, pixels: Floats) -> Floats:
    """Return unit vectors to pixels, (N, 3) in the world."""
    flat = (pixels - np.array(view.camera.center_px)) / np.array(view.camera.focal_px)
    rays = np.column_stack([flat, np.ones(len(flat))])
    turn = view.world_from_camera.matrix()[:3, :3]
    return exact.product(rays / exact.lengths(rays)[:, None], np.ascontiguousarray(turn.T))

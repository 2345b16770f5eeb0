"""Adds noise to masks and camera poses."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid_experiments.modelling.cases import ModelCase

_LUMP_PX = 12  # correlation length of the outline's error in pixels
_HOLE = 0.07  # radius, in square roots of the object's area

Mask = NDArray[np.uint8]


def spoilt_mask(mask: Mask, case: ModelCase, random: np.random.Generator) -> Mask:
    """Return a mask (H, W) with an error of its outline, holes, and wrong pixels."""
    if case.edge_px > 0.0:
        mask = _warped(mask, case.edge_px, random)
    if case.holes > 0.0:
        mask = _with_holes(mask, case.holes, random)
    if case.flipped > 0.0:
        mask = np.where(random.random(mask.shape) < case.flipped, 255 - mask, mask)
    return np.ascontiguousarray(mask, np.uint8)


def spoilt_pose(pose: Pose, case: ModelCase, random: np.random.Generator) -> Pose:
    """Return a camera's pose with errors of position and rotation."""
    place = random.normal(size=3) * 0.001 * case.place_mm
    turn = random.normal(size=3) * np.radians(case.turn_deg)
    moved = Pose.from_parts(place.tolist(), (1.0, 0.0, 0.0, 0.0))
    return pose @ moved @ Pose.exp([0.0, 0.0, 0.0, *turn.tolist()])


def _warped(mask: Mask, off_px: float, random: np.random.Generator) -> Mask:
    """Shift each pixel by smooth noise with a standard deviation of `off_px` along both axes."""
    height, width = mask.shape
    rows, columns = np.mgrid[:height, :width]
    down, right = (off_px * _smooth((height, width), random) for _ in range(2))
    v = np.clip(np.rint(rows + down), 0, height - 1).astype(int)
    u = np.clip(np.rint(columns + right), 0, width - 1).astype(int)
    return mask[v, u]


def _smooth(shape: tuple[int, int], random: np.random.Generator) -> Floats:
    """Return smooth noise (H, W) of standard deviation 1 everywhere."""
    height, width = shape
    grid = random.normal(size=(height // _LUMP_PX + 2, width // _LUMP_PX + 2))
    down, right = (_weights(length, _LUMP_PX) for length in shape)
    return down @ grid[: down.shape[1], : right.shape[1]] @ right.T


def _weights(length: int, step: int) -> Floats:
    """Return the weights of `length` pixels on marks `step` apart; their squares sum to 1."""
    places = np.arange(length)[:, None] / step - np.arange(length // step + 2)[None]
    weights = np.maximum(1.0 - np.abs(places), 0.0)
    return weights / np.linalg.norm(weights, axis=1, keepdims=True)


def _with_holes(mask: Mask, share: float, random: np.random.Generator) -> Mask:
    """Punch discs into the object until `share` of it is missing."""
    inside = np.argwhere(mask > 0)
    radius = _HOLE * np.sqrt(len(inside))
    rows, columns = np.mgrid[: mask.shape[0], : mask.shape[1]]
    kept = mask > 0
    while np.count_nonzero(kept) > (1.0 - share) * len(inside):
        v, u = inside[random.integers(len(inside))]
        kept &= (rows - v) ** 2 + (columns - u) ** 2 > radius**2
    return np.where(kept, np.uint8(255), np.uint8(0))

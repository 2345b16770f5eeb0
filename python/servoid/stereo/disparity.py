"""Matches rectified images: semi-global matching, then Lucas-Kanade for sub-pixel accuracy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.camera import gaussian

Gray = NDArray[np.uint8]
Field = NDArray[np.floating]

_BLOCK_PX = 5
_STEPS = 3
_SIGMA_PX = 3.0
_LARGEST_CORRECTION_PX = 1.5
_LARGEST_SIGMA_PX = 1.0
_LEAST_AGREEMENT = 0.6
_LEAST_STIFFNESS = 10.0  # keeps the disparity where there is no texture
_SMOOTH_PX = 1.5
_LEAST_NOISE = 1.0  # grey levels: rounding, compression and resampling


@dataclass(frozen=True)
class Match:
    """Disparities of image a, NaN where unknown, and their expected errors, in pixels."""

    disparity: Field
    sigma_px: Field


def coarse_disparity(one: Gray, other: Gray, count: int) -> Field:
    """Match by semi-global matching alone, with disparities from 0 up to `count`.

    Returns:
        (H, W) float32, NaN where unknown.

    """
    import cv2

    count = 16 * max(1, -(-count // 16))
    area = _BLOCK_PX * _BLOCK_PX
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=count,
        blockSize=_BLOCK_PX,
        P1=8 * area,
        P2=32 * area,
        disp12MaxDiff=1,
        preFilterCap=31,
        uniquenessRatio=5,
        speckleWindowSize=100,
        speckleRange=2,
        mode=cv2.STEREO_SGBM_MODE_HH,
    )
    # Columns without room for the largest disparity would not be matched.
    padded = [
        np.asarray(cv2.copyMakeBorder(image, 0, 0, count, 0, cv2.BORDER_REPLICATE))
        for image in (one, other)
    ]
    found = np.asarray(matcher.compute(*padded))[:, count:].astype(np.float32) / 16.0
    found[found < 0.0] = np.nan
    return found


def match(one: Gray, other: Gray, count: int, wanted: NDArray[np.bool_]) -> Match:
    """Match the pixels in `wanted` with sub-pixel accuracy; disparities from 0 up to `count`.

    Other pixels do not affect the disparities beside them.
    """
    start = coarse_disparity(one, other, count)
    known = np.isfinite(start) & wanted
    return _refine(one.astype(np.float32), other.astype(np.float32), start, known)


def _refine(one: Field, other: Field, start: Field, known: NDArray[np.bool_]) -> Match:
    """Refine each disparity to where the windows around the pixel agree best.

    Each step warps the other image by the whole field, so that slanted surfaces match as well as
    those that face the cameras.
    """
    smooth, mean = _Average(known, _SMOOTH_PX), _Average(known, _SIGMA_PX)
    first = smooth.of(np.where(known, start, 0.0))
    field = first
    for _ in range(_STEPS - 1):
        step = _compare(one, other, field, mean)
        field = smooth.of(field - step.move)
    step = _compare(one, other, field, mean)
    field = field - step.move
    good = known & (np.abs(field - first) < _LARGEST_CORRECTION_PX)
    good &= (step.sigma_px < _LARGEST_SIGMA_PX) & (step.agreement > _LEAST_AGREEMENT)
    return Match(
        np.where(good, field, np.nan).astype(np.float32),
        np.where(good, step.sigma_px, np.nan).astype(np.float32),
    )


class _Average:
    """Averages with Gaussian weights over the known pixels only."""

    def __init__(self, known: NDArray[np.bool_], sigma_px: float) -> None:
        self._known, self._sigma_px = known, sigma_px
        weight = gaussian(known.astype(np.float32), sigma_px)
        self._weight = np.maximum(weight, np.float32(1e-6))

    def of(self, values: NDArray[np.floating]) -> Field:
        held = np.where(self._known, values, 0.0).astype(np.float32)
        return gaussian(held, self._sigma_px) / self._weight


@dataclass(frozen=True)
class _Comparison:
    """The error of a field, its certainty, and the correlation of the windows."""

    move: Field
    sigma_px: Field
    agreement: Field


def _compare(one: Field, other: Field, field: Field, mean: _Average) -> _Comparison:
    """Warp the other image by a field and take one Lucas-Kanade step."""
    import cv2

    columns, rows = np.meshgrid(
        np.arange(one.shape[1], dtype=np.float32), np.arange(one.shape[0], dtype=np.float32)
    )
    warped = np.asarray(cv2.remap(other, columns - field, rows, cv2.INTER_CUBIC), np.float32)
    (here, power), (there, power_there) = (_flatten(image, mean) for image in (one, warped))
    there = there * np.sqrt((power + _LEAST_NOISE) / (power_there + _LEAST_NOISE))
    slope = 0.5 * (_slope(here) + _slope(there))
    residual = here - there
    stiffness = mean.of(slope * slope) + _LEAST_STIFFNESS
    noise = np.sqrt(mean.of(residual * residual)) + _LEAST_NOISE
    # A Gaussian averages 4 pi sigma^2 pixels; their errors are correlated, so a tenth counts.
    samples = 0.4 * np.pi * _SIGMA_PX * _SIGMA_PX
    return _Comparison(
        move=np.clip(mean.of(slope * residual) / stiffness, -0.5, 0.5),
        sigma_px=noise / np.sqrt(stiffness * samples),
        agreement=mean.of(here * there) / (power + np.float32(1e-6)),
    )


def _flatten(image: Field, mean: _Average) -> tuple[Field, Field]:
    """Subtract the local mean; return the rest and its local power."""
    flat = image - mean.of(image)
    return flat, mean.of(flat * flat)


def _slope(image: NDArray[np.floating]) -> Field:
    import cv2

    kernel = np.array([[-0.5, 0.0, 0.5]], np.float32)
    return np.asarray(cv2.filter2D(image.astype(np.float32), -1, kernel), np.float32)

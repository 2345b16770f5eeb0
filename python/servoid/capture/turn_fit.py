"""Finds how two cameras are turned against each other, from features that match in their images.

A camera that is turned about the axis across the baseline moves what it sees along its epipolar
lines, where a matched feature cannot contradict it, and makes all depths wrong. But lines far from
the middle of the image lean as well, and many features together show that to a part of a degree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Pose
from servoid.capture.matched_features import MatchedFeatures, unit_px, unit_rays
from servoid.pose import Floats, exact

_FREE = 5  # the turn, and the direction of the baseline
_STEP = 1e-5
_STEPS = 8
_CONVERGED = 1e-6
_MOST = 1.0
_INLIER_PX = 0.5  # at 1000 px of diagonal: nearer features count most
_NOISE_PX = 0.1  # at 1000 px of diagonal: at least, of matched features
# Of eight recorded pairs the turn is 0.07 degrees at most, but for a real one, whose lenses are not
# quite calibrated: of 0.47 degrees, with which features are 1.2 times nearer.
_LEAST_RAD, _MOST_RAD = 0.006, 0.07  # beyond, another focal length looks alike
_SURE = 6.0  # standard deviations
_BETTER = 1.5  # times nearer
_FITS_PX = 0.5  # at 1000 px of diagonal
_SURELY_BETTER = 2.0  # times nearer
_LEAST = 60  # features


@dataclass(frozen=True)
class TurnFit:
    """How features say that the second camera is turned from where its calibration has it.

    `angle` is that about the axis across the baseline and the optical axis, by which depths are
    wrong, with its standard deviation `sigma`, in radians. Half of the `count` features are nearer
    than `given_px` to their epipolar lines, and than `best_px` with the turn.
    """

    angle: float
    sigma: float
    given_px: float
    best_px: float
    count: int
    unit: float

    @classmethod
    def of(cls, pairs: Sequence[MatchedFeatures]) -> "TurnFit | None":
        """Return the best fit to features of two cameras' images; None if there is none."""
        first, second = pairs[0].lenses
        axis = np.cross([0.0, 0.0, 1.0], pairs[0].second_from_first.translation)
        length = exact.norm(axis)
        if not length > 0.0:  # at one place, or one behind the other
            return None
        one = np.concatenate([unit_rays(first, pair.first_px) for pair in pairs])
        other = np.concatenate([unit_rays(second, pair.second_px) for pair in pairs])
        kept = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
        if kept.sum() < _LEAST:
            return None
        rays = _Rays(one[kept], other[kept], pairs[0].second_from_first, second.focal_px[0])
        unit = unit_px(second)
        numbers = np.zeros(_FREE)
        matrix = np.eye(_FREE)
        for _ in range(_STEPS):
            off, slopes = rays.off_px(numbers), rays.slopes(numbers)
            weights = 1.0 / (1.0 + np.square(off / (_INLIER_PX * unit)))
            matrix = exact.product((slopes * weights[:, None]).T.copy(), slopes)
            try:
                step = exact.solve(matrix, -exact.product(slopes.T.copy(), weights * off))
            except ValueError:
                return None
            numbers = numbers + step
            if not np.abs(numbers).max() < _MOST:
                return None
            if np.abs(step).max() < _CONVERGED:
                break
        off = rays.off_px(numbers)
        best_px = float(np.median(np.abs(off)))
        noise = max(1.48 * best_px, _NOISE_PX * unit)
        try:
            covariance = exact.solve(matrix, np.eye(_FREE)) * (noise * noise)
        except ValueError:
            return None
        given_px = float(np.median(np.abs(rays.off_px(np.zeros(_FREE)))))
        axis /= length
        variance = exact.dot(axis, exact.product(covariance[:3, :3].copy(), axis))
        angle, sigma = exact.dot(axis, numbers[:3]), float(np.sqrt(max(variance, 0.0)))
        return cls(angle, sigma, given_px, best_px, len(off), unit)

    @property
    def is_turned(self) -> bool:
        """Return whether the camera is turned so that depths are wrong."""
        return self._is_better(_BETTER)

    @property
    def is_surely_turned(self) -> bool:
        """Return whether nothing else explains what is seen."""
        return self._is_better(_SURELY_BETTER)

    def _is_better(self, times: float) -> bool:
        is_sure = max(_LEAST_RAD, _SURE * self.sigma) < abs(self.angle) < _MOST_RAD
        is_near = self.best_px < _FITS_PX * self.unit
        return is_sure and is_near and self.given_px > times * self.best_px

    def note(self, names: tuple[str, str]) -> str:
        """Return a message that names the angle, for two named cameras."""
        one, other = names
        return (
            f"the images contradict the calibration of {one} and {other}: {other} is turned "
            f"towards the other, or away from it, by {abs(np.degrees(self.angle)):.1f} degrees, "
            "which makes all distances wrong: with that, half of "
            f"{self.count} features are {self.best_px:.2f} px from where the other image predicts "
            f"them, instead of {self.given_px:.2f}; calibrate the two cameras again"
        )


@dataclass(frozen=True, eq=False)
class _Rays:
    """Unit vectors to what two cameras see, (N, 3) each, and how they are mounted."""

    one: Floats
    other: Floats
    second_from_first: Pose
    focal_px: float

    def off_px(self, numbers: Floats) -> Floats:
        """Return the distances of features to their epipolar lines, with their sign."""
        mount = self.second_from_first.matrix()
        turn = Pose.exp([0.0, 0.0, 0.0, *numbers[:3].tolist()]).matrix()[:3, :3]
        along = mount[:3, 3] / exact.norm(mount[:3, 3])
        aside = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
        aside /= exact.norm(aside)
        along = along + numbers[3] * aside + numbers[4] * np.cross(along, aside)
        axis = exact.product(turn, along)
        across = np.array(
            [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]]
        )
        essential = exact.product(across, exact.product(turn, mount[:3, :3].copy()))
        line = exact.product(self.one, essential.T.copy())
        back = exact.product(self.other, essential)
        # To first order the distance to the nearest pair of rays that meet (Sampson).
        normal = np.square(line).sum(axis=1) - np.square((line * self.other).sum(axis=1))
        normal += np.square(back).sum(axis=1) - np.square((back * self.one).sum(axis=1))
        return self.focal_px * (line * self.other).sum(axis=1) / np.sqrt(normal)

    def slopes(self, numbers: Floats) -> Floats:
        """Return the derivatives of `off_px` by the numbers, (N, 5)."""
        steps = _STEP * np.eye(_FREE)
        pairs = [(self.off_px(numbers + step), self.off_px(numbers - step)) for step in steps]
        return np.stack([(more - less) / (2.0 * _STEP) for more, less in pairs], axis=1)

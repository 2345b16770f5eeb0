"""Finds how two cameras are turned against each other, from features that match in their images.

A camera that is turned about the axis across the baseline moves what it sees along its epipolar
lines, where a matched feature cannot contradict it, and makes all depths wrong. But lines far from
the middle of the image lean as well, and many features together show that to a part of a degree.
Lenses whose distortion is not in the calibration bend them much alike, but near things more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Pose
from servoid.capture.matched_features import MatchedFeatures, unit_px, unit_rays
from servoid.pose import Floats, RobustFit, exact, robust_fit

# The numbers that are fitted: the turn, the direction of the baseline, the lenses' distortion.
_COUNT = 6
_MOUNT, _BENT = (0, 1, 2, 3, 4), (0, 1, 2, 5)
_MOST = 1.0  # of any of them
_INLIER_PX = 0.5  # at 1000 px of diagonal: nearer features count most
_NOISE_PX = 0.1  # at 1000 px of diagonal: at least, of matched features
_AHEAD = 0.2  # cosine: what is farther from the optical axis is not used
# Of eight recorded pairs the turn is 0.07 degrees at most, but for a real one, whose lenses are not
# quite calibrated: of 0.47 degrees, with which features are 1.2 times nearer.
_LEAST_RAD, _MOST_RAD = 0.006, 0.2
_MOST_TOED_RAD = 0.07  # of cameras that are turned towards each other: a focal length looks alike
_TOED_RAD = 0.01
_SURE = 6.0  # standard deviations
_BETTER = 1.5  # times nearer
_FITS_PX = 0.5  # at 1000 px of diagonal
_SURELY_BETTER = 2.0  # times nearer
_LEAST = 60  # features
# By how much the turn may differ if a distortion is fitted as well. Of pairs turned by 1 degree
# it is 0.36 degrees at most, of the same with a distortion of 0.1 or 0.2 0.7 and more, but for one.
_AGREES, _AGREES_RAD = 0.3, 0.002


@dataclass(frozen=True)
class TurnFit:
    """How features say that the second camera is turned from where its calibration has it.

    `angle` is that about the axis across the baseline and the optical axis, by which depths are
    wrong, with its standard deviation `sigma`, in radians; `bent_angle` is the same if the lenses
    have a distortion that is not in the calibration. Half of the `count` features are nearer than
    `given_px` to their epipolar lines, and than `best_px` with the turn; `unit` is a thousandth of
    the image's diagonal, in pixels. The angle is at most `most`.
    """

    angle: float
    sigma: float
    bent_angle: float
    given_px: float
    best_px: float
    count: int
    unit: float
    most: float

    @classmethod
    def of(cls, pairs: Sequence[MatchedFeatures]) -> "TurnFit | None":
        """Return the best fit to features of two cameras' images; None if there is none."""
        first, second = pairs[0].lenses
        axis = np.cross([0.0, 0.0, 1.0], pairs[0].second_from_first.translation)
        length = exact.norm(axis)
        if not length > 0.0:  # at one place, or one behind the other
            return None
        axis /= length
        one = np.concatenate([unit_rays(first, pair.first_px) for pair in pairs])
        other = np.concatenate([unit_rays(second, pair.second_px) for pair in pairs])
        kept = (one[:, 2] > _AHEAD) & (other[:, 2] > _AHEAD)  # not of NaN
        if kept.sum() < _LEAST:
            return None
        one, other = (rays[kept, :2] / rays[kept, 2:] for rays in (one, other))
        rays = _Rays(one, other, pairs[0].second_from_first, second.focal_px[0])
        unit = unit_px(second)
        mount, bent = (rays.fitted(free, unit) for free in (_MOUNT, _BENT))
        if mount is None or bent is None:
            return None
        off, given = (
            np.median(np.abs(rays.off_px(_placed(numbers, _MOUNT))))
            for numbers in (mount.numbers, np.zeros(len(_MOUNT)))
        )
        noise = max(1.48 * float(off), _NOISE_PX * unit)
        variance = exact.dot(axis, exact.product(mount.inverse[:3, :3].copy(), axis))
        return cls(
            angle=exact.dot(axis, mount.numbers[:3]),
            sigma=noise * float(np.sqrt(max(variance, 0.0))),
            bent_angle=exact.dot(axis, bent.numbers[:3]),
            given_px=float(given),
            best_px=float(off),
            count=len(one),
            unit=unit,
            most=_MOST_TOED_RAD if _is_toed(pairs[0].second_from_first) else _MOST_RAD,
        )

    @property
    def is_turned(self) -> bool:
        """Return whether the camera is turned so that depths are wrong."""
        return self._is_better(_BETTER) and self._agrees

    @property
    def is_surely_turned(self) -> bool:
        """Return whether nothing else explains what is seen."""
        return self._is_better(_SURELY_BETTER) and self._agrees

    @property
    def is_turned_or_bent(self) -> bool:
        """Return whether it is turned, or the lenses have a distortion that nobody measured."""
        return self._is_better(_BETTER) and not self._agrees

    @property
    def _agrees(self) -> bool:
        apart = abs(self.bent_angle - self.angle)
        return apart < _AGREES * abs(self.angle) + _AGREES_RAD

    def _is_better(self, times: float) -> bool:
        is_sure = max(_LEAST_RAD, _SURE * self.sigma) < abs(self.angle) < self.most
        is_near = self.best_px < _FITS_PX * self.unit
        return is_sure and is_near and self.given_px > times * self.best_px

    def note(self, names: tuple[str, str]) -> str:
        """Return a message that names the angle, for two named cameras."""
        one, other = names
        or_bent = (
            ""
            if self._agrees
            else ", or the lenses have a distortion that is not in the calibration"
        )
        return (
            f"the images contradict the calibration of {one} and {other}: {other} is turned by "
            f"{abs(np.degrees(self.angle)):.1f} degrees towards {one}, or away from it{or_bent}: "
            f"all distances are wrong. With that turn, half of {self.count} features are "
            f"{self.best_px:.2f} px from where the other image predicts them, instead of "
            f"{self.given_px:.2f}; calibrate the two cameras again"
        )


@dataclass(frozen=True, eq=False)
class _Rays:
    """Where two cameras see features, (N, 2) each, at a distance of 1, and how they are mounted."""

    one: Floats
    other: Floats
    second_from_first: Pose
    focal_px: float

    def fitted(self, free: Sequence[int], unit: float) -> RobustFit | None:
        """Return the best of the numbers that are free; None if features leave one open."""

        def off(numbers: Floats) -> Floats:
            return self.off_px(_placed(numbers, free))[:, None]

        fit = robust_fit(off, len(free), _INLIER_PX * unit)
        return fit if fit is not None and np.abs(fit.numbers).max() < _MOST else None

    def off_px(self, numbers: Floats) -> Floats:
        """Return the distances of features to their epipolar lines, with their sign."""
        one, other = _bent(self.one, float(numbers[5])), _bent(self.other, float(numbers[5]))
        mount = self.second_from_first.matrix()
        turn = Pose.exp([0.0, 0.0, 0.0, *numbers[:3].tolist()]).matrix()[:3, :3]
        along = mount[:3, 3] / exact.norm(mount[:3, 3])
        aside = np.cross(along, [0.0, 0.0, 1.0])
        aside /= exact.norm(aside)
        along = along + numbers[3] * aside + numbers[4] * np.cross(along, aside)
        axis = exact.product(turn, along)
        across = np.array(
            [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]]
        )
        essential = exact.product(across, exact.product(turn, mount[:3, :3].copy()))
        line = exact.product(one, essential.T.copy())
        back = exact.product(other, essential)
        # To first order the distance to the nearest pair of rays that meet (Sampson).
        product = (line * other).sum(axis=1)
        normal = np.square(line).sum(axis=1) + np.square(back).sum(axis=1)
        normal -= np.square(product) + np.square((back * one).sum(axis=1))
        return self.focal_px * product / np.sqrt(normal)


def _placed(numbers: Floats, free: Sequence[int]) -> Floats:
    """Return all the numbers, (6,), of which some are free, and the others 0."""
    every = np.zeros(_COUNT)
    every[list(free)] = numbers
    return every


def _is_toed(second_from_first: Pose) -> bool:
    return exact.norm(np.array(second_from_first.log()[3:])) > _TOED_RAD


def _bent(places: Floats, distortion: float) -> Floats:
    """Return unit vectors to places in an image, (N, 2), of a lens with a radial distortion."""
    bend = distortion * np.square(places).sum(axis=1)
    # The inverse of r (1 - d r^2), of which `distortion` is d, to the third power.
    bent = places * (1.0 + bend + 3.0 * bend * bend + 12.0 * bend * bend * bend)[:, None]
    rays = np.concatenate([bent, np.ones((len(bent), 1))], axis=1)
    return rays / exact.lengths(rays)[:, None]

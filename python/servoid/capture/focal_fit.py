"""Finds the focal length that matched features fit, and reports those that contradict the cameras.

Matched features in two images lie on each other's epipolar lines. If the given lens and poses
contradict this, and another focal length fits better, that focal length is reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid._native import Lens
from servoid.capture.exchanged import contradiction_note
from servoid.capture.matched_features import MatchedFeatures, unit_px
from servoid.pose import Floats, exact
from servoid.words import digits

_LEAST = 60  # matches
# The focal lengths to try, as factors of the given one.
_TRIED = exact.exp(np.linspace(-0.8, 0.8, 321))
_CLOSE = 0.02  # relative error of the focal length that is not reported
_BETTER = 1.1  # factor by which the distances of features to their lines must decrease
# The same where features contradict a pair: 11 and more for wrong focal lengths, 1.7 to 2.2 for a
# recorded camera that is turned by 2 degrees.
_EXPLAINED = 4.0
_AT_ONCE = 1 << 14  # features times factors: more take memory that is not in the caches
_PARTS = 8  # of the matches, for leave-one-part-out; all parts must agree
_SURE = 4.0  # standard deviations
FIT_PX = 1.0  # at 1000 px of diagonal: features that fit are nearer to their lines than this
OFF_PX = 2.5  # at 1000 px of diagonal: features further off contradict the cameras' poses


def turned_note(names: tuple[str, str], pairs: Sequence[MatchedFeatures]) -> str | None:
    """Return a message if features contradict two cameras that are turned to each other.

    A focal length is named only if it explains what contradicts them: where a camera is turned, a
    longer one also fits better, but not well.
    """
    note = contradiction_note(names, pairs)
    return focal_note(pairs, is_rig=True, must_explain=note is not None) or note


def focal_note(
    pairs: Sequence[MatchedFeatures], *, is_rig: bool, must_explain: bool = False
) -> str | None:
    """Return a message if features are far from their epipolar lines, else None.

    With `must_explain` a focal length is named only if it fits far better, as where something else
    may be wrong. Poses are reported only of a rig.
    """
    fit = FocalFit.of(pairs)
    if fit is None:
        return None
    if fit.explains if must_explain else fit.is_better:
        return fit.note
    if is_rig and min(fit.off_px, fit.best_px) > OFF_PX * unit_px(pairs[0].lenses[0]):
        return (
            f"the images contradict the poses of the cameras: features are {fit.off_px:.1f} px "
            "from where the other image predicts them; calibrate again"
        )
    return None


@dataclass(frozen=True)
class FocalFit:
    """The focal length that features fit best, as a `share` of the given one, in pixels.

    Features are so many pixels from their epipolar lines with the given one and with the best.
    `is_better` says that another one certainly fits better.
    """

    given_px: float
    share: float
    off_px: float
    best_px: float
    is_better: bool

    @classmethod
    def of(cls, pairs: Sequence[MatchedFeatures]) -> "FocalFit | None":
        """Return the best fit to the features of some pairs; None if they are too few."""
        if sum(len(pair.first_px) for pair in pairs) < _LEAST:
            return None
        lens = pairs[0].lenses[0]
        tried = [_offs_px(pair, _TRIED) for pair in pairs]
        share, best_px = _best(tried)
        off_px = float(np.median(_offs_as_given_px(pairs)))
        # An object on a turntable before a static room fits no focal length.
        is_found = best_px < FIT_PX * unit_px(lens) and off_px > _BETTER * best_px
        wrong = abs(share - 1.0)
        is_better = is_found and wrong > _CLOSE and wrong > _SURE * _deviation(tried, share)
        return cls(float(np.mean(lens.focal_px)), share, off_px, best_px, is_better)

    @property
    def explains(self) -> bool:
        """Return whether the other focal length fits so much better that nothing else is wrong."""
        return self.is_better and self.off_px > _EXPLAINED * self.best_px

    @property
    def note(self) -> str:
        """Return a message that names the focal length."""
        bound = {_TRIED[0]: "at most", _TRIED[-1]: "at least"}.get(self.share, "about")
        return (
            f"the images fit a focal length of {bound} {self.share * self.given_px:.0f} px better "
            f"than {self.given_px:.0f} px: features are {digits(round(self.best_px, 2))} px from "
            f"where the other image predicts them, instead of {digits(round(self.off_px, 2))}; "
            "calibrate again"
        )


def usual_off(pairs: Sequence[MatchedFeatures]) -> float:
    """Return the median distance of features to their epipolar lines, at 1000 px of diagonal."""
    return float(np.median(_offs_as_given_px(pairs))) / unit_px(pairs[0].lenses[0])


def _deviation(tried: Sequence[Floats], share: float) -> float:
    """Return the standard deviation of the best share, by leaving out a part of the features."""
    others = np.array(
        [_best([_without(offs, number) for offs in tried])[0] for number in range(_PARTS)]
    )
    return float(np.sqrt((_PARTS - 1) * np.mean(np.square(others - share))))


def _without(offs: Floats, number: int) -> Floats:
    """Return the distances of a pair's features, (S, N), without those of one part of them."""
    return offs[:, np.arange(offs.shape[1]) % _PARTS != number]


def _best(tried: Sequence[Floats]) -> tuple[float, float]:
    """Return the best factor of the focal length, and the median distance with it.

    Each pair has the distances of its N features for all S factors that are tried, (S, N).
    """
    medians = np.median(np.concatenate(tried, axis=1), axis=1)
    least = int(np.argmin(medians))
    return float(_TRIED[least]), float(medians[least])


def _offs_as_given_px(pairs: Sequence[MatchedFeatures]) -> Floats:
    """Return the distances of all features to their epipolar lines, (N,), for the given lenses."""
    return np.concatenate([_offs_px(pair, np.ones(1))[0] for pair in pairs])


def offs_beside_px(pair: MatchedFeatures, shift_px: tuple[float, float]) -> Floats:
    """Return the distances of features to their epipolar lines, (N,), if lenses are centred beside.

    Their principal points are displaced by so many pixels.
    """
    beside = MatchedFeatures(
        pair.lenses, pair.second_from_first, pair.first_px - shift_px, pair.second_px - shift_px
    )
    return _offs_px(beside, np.ones(1))[0]


def _offs_px(pair: MatchedFeatures, shares: Floats) -> Floats:
    """Return the distances of features to their epipolar lines for focal length factors, (S, N)."""
    matrix = pair.second_from_first.matrix()
    x, y, z = matrix[:3, 3] / exact.norm(matrix[:3, 3])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    essential = exact.product(cross, matrix[:3, :3])
    count = max(_AT_ONCE // max(len(pair.first_px), 1), 1)
    return np.concatenate(
        [
            _offs_from_lines_px(pair, essential, shares[start : start + count])
            for start in range(0, len(shares), count)
        ]
    )


def _offs_from_lines_px(pair: MatchedFeatures, essential: Floats, shares: Floats) -> Floats:
    """Return the distances for an essential matrix that takes the first rays to their lines."""
    first, second = (
        _flat(lens, pixels, shares)
        for lens, pixels in zip(pair.lenses, (pair.first_px, pair.second_px), strict=True)
    )
    there, back = exact.product(first, essential.T), exact.product(second, essential)
    slope = exact.hypot(exact.lengths(there[:, :2]), exact.lengths(back[:, :2]))
    offs = np.abs((second * there).sum(axis=1)) / np.maximum(slope, 1e-12)
    offs = offs.reshape(len(shares), -1) * shares[:, None] * pair.lenses[0].focal_px[0]
    # Where a shorter focal length puts a feature, a lens with strong distortion may see nothing.
    return np.where(np.isfinite(offs), offs, np.inf)


def _flat(lens: Lens, pixels: Floats, shares: Floats) -> Floats:
    """Return rays, (S * N, 3) with z = 1, for a lens, its focal length multiplied by factors."""
    center = np.array(lens.center_px)
    rays = lens.rays(((pixels - center) / shares[:, None, None] + center).reshape(-1, 2))
    return rays / rays[:, 2:]

"""Finds the principal point that matched features fit, where another focal length may not be meant.

A wrong principal point makes another focal length fit a little better than the given one. Of
photographs with a principal point that is 25 px off, the right one leaves a quarter to a third of
the distances to epipolar lines, and the best focal length nine tenths; where the focal length is
wrong by a fifth, the best principal point leaves three quarters of them, and the right focal length
a half.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.capture.focal_fit import FIT_PX, FocalFit, offs_beside_px
from servoid.capture.matched_features import MatchedFeatures, unit_px
from servoid.pose import exact
from servoid.words import digits

_REACH = 60.0  # at 1000 px of diagonal: what is tried to each side
_STEPS = 12  # in which it is tried
_FINER = 4  # times, in the second round
_DOUBTED_PX = 0.3  # at 1000 px of diagonal: of right photographs, features are off by 0.2
_CLEARLY = 1.1  # factor by which one of two fits is better
_EXPLAINED = 3.0  # the same where a principal point is reported and no focal length fits better
_CLOSE_PX = 8.0  # at 1000 px of diagonal: an error that is not reported


def views_note(pairs: Sequence[MatchedFeatures]) -> str | None:
    """Return a message if another focal length or principal point fits views better, else None."""
    focal = FocalFit.of(pairs)
    if focal is None:
        return None
    unit = unit_px(pairs[0].lenses[0])
    if not focal.is_better and focal.off_px < _DOUBTED_PX * unit:
        return None
    center = _CenterFit.of(pairs)
    if not focal.is_better:
        explains = center.best_px < min(FIT_PX * unit, focal.off_px / _EXPLAINED)
        far = exact.hypot(*center.shift_px) > _CLOSE_PX * unit
        return center.note(focal.off_px) if explains and far else None
    if center.best_px > _CLEARLY * focal.best_px:
        return focal.note
    if focal.best_px > _CLEARLY * center.best_px:
        return center.note(focal.off_px)
    return (
        f"{focal.note}; a principal point of about {center.words} fits as well, so that either may "
        "be wrong"
    )


@dataclass(frozen=True)
class _CenterFit:
    """The principal point that features fit best, and how far they are off with it, in pixels."""

    given_px: tuple[float, float]
    shift_px: tuple[float, float]
    best_px: float

    @classmethod
    def of(cls, pairs: Sequence[MatchedFeatures]) -> "_CenterFit":
        """Try principal points around the given one, and then around the best of them."""
        lens = pairs[0].lenses[0]
        step = _REACH * unit_px(lens) / _STEPS
        best = 0.0, 0.0
        found = np.inf
        for size, count in ((step, _STEPS), (step / _FINER, _FINER)):
            sides = size * np.arange(-count, count + 1)
            tried = [(best[0] + x, best[1] + y) for y in sides.tolist() for x in sides.tolist()]
            offs = [_off_px(pairs, shift) for shift in tried]
            least = int(np.argmin(offs))
            best, found = tried[least], offs[least]
        x, y = lens.center_px
        return cls((x, y), best, found)

    @property
    def words(self) -> str:
        """Return the principal point."""
        x, y = (at + by for at, by in zip(self.given_px, self.shift_px, strict=True))
        return f"({x:.0f}, {y:.0f}) px"

    def note(self, off_px: float) -> str:
        """Return a message that names the principal point; with the given one, so far off."""
        given = "({:.0f}, {:.0f}) px".format(*self.given_px)
        return (
            f"the images fit a principal point of about {self.words} better than {given}: features "
            f"are {digits(round(self.best_px, 2))} px from where the other image predicts them, "
            f"instead of {digits(round(off_px, 2))}; check center_px, or calibrate again"
        )


def _off_px(pairs: Sequence[MatchedFeatures], shift_px: tuple[float, float]) -> float:
    return float(np.median(np.concatenate([offs_beside_px(pair, shift_px) for pair in pairs])))

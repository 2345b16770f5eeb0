"""Compares what two cameras locate with where a third camera sees it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.capture.matched_features import MatchedFeatures, closest_points, unit_px, unit_rays
from servoid.pose import Floats, exact
from servoid.words import digits, joined

_LEAST = 20  # features that all three see
_PARALLAX_PX = 2.0  # at 1000 px of diagonal: with less, a place is noise
_NOISE_PX = 0.5  # at 1000 px of diagonal: of a disparity
_MOST_ENLARGED = 4.0  # times, by the distance of the third camera


@dataclass(frozen=True)
class OffInThird:
    """How far features are off in a third camera in the median, and how far they may, in pixels."""

    count: int
    off_px: float
    most_px: float

    @property
    def is_off(self) -> bool:
        """Return whether features are too far off."""
        return self.off_px > self.most_px

    def note(self, names: Sequence[str]) -> str | None:
        """Return a message if the features contradict the poses of three named cameras."""
        if not self.is_off:
            return None
        off = f"{digits(round(self.off_px, 1))} px" if np.isfinite(self.off_px) else "far"
        return (
            f"the images contradict the calibration of {joined(names)}: of {self.count} features "
            f"that all three see, half are {off} or more from where two of them place them for the "
            "third; correct the pose of one camera relative to the others, or calibrate again"
        )


def off_in_third(
    to_second: MatchedFeatures, to_third: MatchedFeatures, *, allowed: float
) -> OffInThird | None:
    """Locate features of a camera by a second one, and compare them with their places in a third.

    Both pairs begin with the same image. Of right cameras, features may be off by so many
    thousandths of the diagonal as `allowed`, and the noise. None if all three see too few.
    """
    places = {tuple(pixel): row for row, pixel in enumerate(to_third.first_px.tolist())}
    rows = np.array([places.get(tuple(pixel), -1) for pixel in to_second.first_px.tolist()])
    pair = to_second.part(rows >= 0)
    seen_px = to_third.second_px[rows[rows >= 0]]
    points, is_near = _located(pair)
    rays = unit_rays(to_third.lenses[1], seen_px)
    kept = is_near & np.isfinite(points).all(axis=1) & np.isfinite(rays).all(axis=1)
    apart, third_apart = (
        exact.norm(np.asarray(one.second_from_first.translation)) for one in (to_second, to_third)
    )
    if kept.sum() < _LEAST or not 0.0 < third_apart <= _MOST_ENLARGED * apart:
        return None
    matrix = to_third.second_from_first.matrix()
    moved = exact.product(points[kept], np.ascontiguousarray(matrix[:3, :3].T)) + matrix[:3, 3]
    is_ahead = (moved * rays[kept]).sum(axis=1) > 0.0
    sizes = np.where(is_ahead, exact.lengths(moved), 1.0)
    off = np.where(is_ahead, exact.lengths(np.cross(moved, rays[kept])) / sizes, np.inf)
    unit = unit_px(to_third.lenses[1])
    most_px = unit * (allowed + _NOISE_PX * third_apart / apart)
    return OffInThird(
        int(kept.sum()), float(np.median(off)) * to_third.lenses[1].focal_px[0], most_px
    )


def _located(pair: MatchedFeatures) -> tuple[Floats, NDArray[np.bool_]]:
    """Return where rays of two cameras come closest, (N, 3) in the first's frame, and whether near.

    What is behind the first camera is as well: its place is wrong, and not unknown.
    """
    points, sines = closest_points(pair)
    unit = unit_px(pair.lenses[0]) / pair.lenses[0].focal_px[0]
    return points, sines > _PARALLAX_PX * unit

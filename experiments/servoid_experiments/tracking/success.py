"""Measures of success of a tracking trial."""

from collections.abc import Callable

import numpy as np

from servoid_experiments.tracking.cases import TrackRow
from servoid_experiments.tracking.footage import last_quarter


def success(row: TrackRow, near: float) -> float:
    """Return the share of images that the tracker reports as tracked, and rightly.

    A pose is right if ADD is at most `near` diameters.
    """
    return float(np.mean(_right(row, near)))


def wrongly_sure(row: TrackRow, near: float) -> float:
    """Return the share of images that the tracker reports as tracked, but wrongly."""
    return float(np.mean(_tracking(row) & ~_right(row, near)))


def success_behind_board(row: TrackRow, near: float) -> float:
    """Return the success in the third quarter, where a board may hide the object."""
    images = len(row.status) + 1
    return float(np.mean(_right(row, near)[images // 2 - 1 : last_quarter(images) - 1]))


def success_at_end(row: TrackRow, near: float) -> float:
    """Return the success in the last quarter, after all disturbances."""
    return float(np.mean(_right(row, near)[last_quarter(len(row.status) + 1) - 1 :]))


def of_tracked(
    errors: Callable[[TrackRow], list[float]], percent: float
) -> Callable[[TrackRow], float | None]:
    """Return a function for a percentile of an error over the images reported as tracked."""

    def percentile(row: TrackRow) -> float | None:
        known = np.array(errors(row))[_tracking(row)]
        return float(np.percentile(known, percent)) if len(known) else None

    return percentile


def _tracking(row: TrackRow) -> np.ndarray:
    return np.array(row.status) == "tracking"


def _right(row: TrackRow, near: float) -> np.ndarray:
    return _tracking(row) & (np.array(row.add_share) <= near)

"""Measures the error of a tracked motion."""

from collections.abc import Sequence

import numpy as np

from servoid._native import Pose
from servoid.pose import Floats


def add_m(found: Pose, true: Pose, points: Floats) -> float:
    """Return ADD: the mean distance of an object's points (N, 3) between two poses, in metres."""
    apart = found.transform(points) - true.transform(points)
    return float(np.linalg.norm(apart, axis=1).mean())


def median_add_m(found: Sequence[Pose], true: Sequence[Pose], points: Floats) -> float:
    """Return the median of ADD from the second observation on, in metres.

    Estimated and true poses of the object are in the same frame; the relation of its own two
    frames is taken from the first observation. `points` are (N, 3).
    """
    body_from_object = found[0].inverse() @ true[0]
    errors = [
        add_m(here @ body_from_object, there, points)
        for here, there in zip(found[1:], true[1:], strict=True)
    ]
    return float(np.median(errors))

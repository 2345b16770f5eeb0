"""Measures the error of a tracked motion."""

from collections.abc import Sequence

import numpy as np

from servoid._native import Pose
from servoid.pose.exact import Floats


def median_add_m(found: Sequence[Pose], true: Sequence[Pose], points: Floats) -> float:
    """Return the median of ADD from the second observation on, in metres.

    ADD is the mean distance of the object's points (N, 3) between the estimated pose and the
    true one. Both are poses of the object in the same frame; the relation of its own two frames
    is taken from the first observation.
    """
    body_from_object = found[0].inverse() @ true[0]
    errors = [
        np.linalg.norm(
            (here @ body_from_object).transform(points) - there.transform(points), axis=1
        ).mean()
        for here, there in zip(found[1:], true[1:], strict=True)
    ]
    return float(np.median(errors))

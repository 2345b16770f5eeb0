"""How far a tracked motion is from the true one since the first observation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackingErrors:
    """Errors (N - 1,) from the second observation on, infinite where there is no estimate.

    `add` is the mean distance of the object's points, and `translation` that of their middle, in
    metres; `rotation` is in radians.
    """

    add: Array
    translation: Array
    rotation: Array


def tracking_errors(
    estimates: Sequence[Array | None], truth: Sequence[Array], points: Array
) -> TrackingErrors:
    """Compare poses world_from_object (4, 4) with the true ones; the object's frames may differ.

    `points` (M, 3) are the object's own, in the frame of the truth.
    """
    assert estimates[0] is not None
    shift = np.linalg.inv(estimates[0]) @ truth[0]
    rows = []
    for estimate, true in zip(estimates[1:], truth[1:], strict=True):
        if estimate is None:
            rows.append((np.inf, np.inf, np.inf))
            continue
        found = estimate @ shift
        apart = points @ (found - true)[:3, :3].T + (found - true)[:3, 3]
        turn = Rotation.from_matrix(found[:3, :3].T @ true[:3, :3]).magnitude()
        mean = float(np.linalg.norm(apart, axis=1).mean())
        rows.append((mean, float(np.linalg.norm(apart.mean(axis=0))), turn))
    add, translation, rotation = np.array(rows).reshape(-1, 3).T
    return TrackingErrors(add, translation, rotation)

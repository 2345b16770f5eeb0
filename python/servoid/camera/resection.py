"""Finds the pose of a camera from places that it sees, of which some may be wrong."""

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.pose import Floats

_LEAST = 6  # places in front of the camera
_TRIES = 1000


def resect(points: Floats, rays: Floats, error: float) -> tuple[Pose, NDArray[np.int64]] | None:
    """Return the pose of a camera, camera_from_points, and the rows of `points` that agree.

    `points` (N, 3) are places, and `rays` (N, 3) directions to them in the camera's frame, of which
    none behind the camera is used; `error` is how far one may be off, in radians. None if they are
    too few, or no pose was found (OpenCV's RANSAC).
    """
    import cv2

    ahead = np.flatnonzero(rays[:, 2] > 0.0)
    if len(ahead) < _LEAST:
        return None
    found, turn, shift, rows = cv2.solvePnPRansac(
        points[ahead],
        rays[ahead, :2] / rays[ahead, 2:],
        np.eye(3),
        None,
        iterationsCount=_TRIES,
        reprojectionError=error,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    is_finite = bool(np.isfinite(turn).all() and np.isfinite(shift).all()) if found else False
    if not is_finite or rows is None:
        return None
    agreeing = ahead[rows.ravel().astype(np.int64)]
    return Pose.from_rvec_tvec(turn.ravel(), shift.ravel()), agreeing

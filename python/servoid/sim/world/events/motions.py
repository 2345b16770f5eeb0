"""Vectorised rigid motions, as rows (w, x, y, z, tx, ty, tz)."""

from collections.abc import Sequence

import numpy as np

from servoid.pose import Floats, Pose, exact

STILL = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def row_of(pose: Pose) -> Floats:
    """Return a pose as a row (7,)."""
    return np.array([*pose.quaternion, *pose.translation])


def pose_of(row: Floats | Sequence[float]) -> Pose:
    """Return a row (7,) as a pose."""
    return Pose.from_parts(row[4:], row[:4])


def unit_row(numbers: Sequence[float] | Floats) -> Floats:
    """Return (w, x, y, z, tx, ty, tz) as a row (7,), with normalised quaternion."""
    row = np.array(numbers, dtype=np.float64)
    row[:4] /= exact.norm(row[:4])
    return row


def rotate(quaternions: Floats, vectors: Floats) -> Floats:
    """Rotate vectors (..., 3) by unit quaternions (..., 4)."""
    w, axis = quaternions[..., :1], quaternions[..., 1:]
    aside = 2.0 * np.cross(axis, vectors)
    return vectors + w * aside + np.cross(axis, aside)


def compose(a_from_b: Floats, b_from_c: Floats) -> Floats:
    """Compose rows (..., 7) to a_from_c (..., 7), with broadcasting."""
    a_from_b, b_from_c = np.broadcast_arrays(a_from_b, b_from_c)
    first, second = a_from_b[..., :4], b_from_c[..., :4]
    w = first[..., :1] * second[..., :1] - (first[..., 1:] * second[..., 1:]).sum(-1, keepdims=True)
    axis = (
        first[..., :1] * second[..., 1:]
        + second[..., :1] * first[..., 1:]
        + np.cross(first[..., 1:], second[..., 1:])
    )
    place = a_from_b[..., 4:] + rotate(first, b_from_c[..., 4:])
    return np.concatenate([w, axis, place], axis=-1)

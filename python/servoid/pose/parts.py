"""Splits poses into parts and joins them without changing a bit, for files."""

from typing import Any

from servoid._native import Pose

_UNIT = 1e-14  # deviation of a quaternion's length from 1 that rounding can cause

Translation = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def parts_of(pose: Pose) -> tuple[Translation, Quaternion]:
    """Return the translation and quaternion (w, x, y, z) from which `joined` makes this pose."""
    # As pickling does: `quaternion` may have the opposite sign.
    pickled: Any = pose.__reduce__()
    return pickled[1]


def joined(translation: Translation, quaternion: Quaternion) -> Pose:
    """Make a pose from a translation x, y, z in metres and a unit quaternion (w, x, y, z).

    `Pose.from_parts` normalises every quaternion, which may change its last bits; a quaternion of
    unit length is used unchanged here.

    Raises:
        PoseError: a number is not finite, or the quaternion is not of unit length.

    """
    squared = sum(one * one for one in quaternion)
    if abs(squared - 1.0) < _UNIT:
        pickled: Any = Pose.identity().__reduce__()
        return pickled[0](translation, quaternion)
    return Pose.from_parts(translation, quaternion)

"""Takes poses apart and joins them again, to the last bit, for files that must not change them."""

from typing import Any

from servoid._native import Pose

_UNIT = 1e-14  # by which the length of a quaternion that rounding alone has touched is off

Translation = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def parts_of(pose: Pose) -> tuple[Translation, Quaternion]:
    """Return translation and quaternion (w, x, y, z) of which `joined` makes the same pose."""
    # As it is pickled: `quaternion` may have the other sign.
    pickled: Any = pose.__reduce__()
    return pickled[1]


def joined(translation: Translation, quaternion: Quaternion) -> Pose:
    """Join parts, x, y, z in metres and a unit quaternion (w, x, y, z), to a pose.

    `Pose.from_parts` brings every quaternion to unit length, which may change its last bits; one
    that has it is taken as it is here.

    Raises:
        PoseError: a number is not finite, or the quaternion is not of unit length.

    """
    squared = sum(one * one for one in quaternion)
    if abs(squared - 1.0) < _UNIT:
        pickled: Any = Pose.identity().__reduce__()
        return pickled[0](translation, quaternion)
    return Pose.from_parts(translation, quaternion)

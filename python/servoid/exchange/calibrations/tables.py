"""The parts that calibrations by other programs share: camera matrices, names and checks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.capture import check_reach
from servoid.config import MOST_CAMERAS, NEAR_M, implausible, name_fault
from servoid.errors import CaptureError, located
from servoid.source import MountedCamera
from servoid.words import counted, digits

Size = tuple[int, int]


@dataclass(frozen=True)
class ToolCalibration:
    """The cameras of a calibration by another program; the first one's frame is the rig's.

    `notes` are messages for the user. `more` is the end of the message that reports that the file
    has too few cameras; empty if nothing is known about how to give more.
    """

    cameras: tuple[MountedCamera, ...]
    notes: tuple[str, ...] = ()
    more: str = ""


class Matrix(msgspec.Struct, frozen=True, kw_only=True):
    """Holds a matrix as ROS and OpenCV write it: its numbers row by row."""

    rows: int
    cols: int
    data: tuple[float, ...]

    def shaped(self, place: str, *shapes: Size) -> NDArray[np.float64]:
        """Return the matrix, whose shape must be one of `shapes`; CaptureError otherwise."""
        if (self.rows, self.cols) not in shapes or len(self.data) != self.rows * self.cols:
            wanted = " or ".join(f"{rows}x{columns}" for rows, columns in shapes)
            raise CaptureError(
                f"{place} has {self.rows} rows, {self.cols} columns and "
                f"{counted(len(self.data), 'number')}; it must be {wanted}"
            )
        return np.array(self.data, np.float64).reshape(self.rows, self.cols)

    def camera(self, place: str) -> NDArray[np.float64]:
        """Return a camera matrix: focal lengths and principal point; CaptureError if it is none."""
        matrix = self.shaped(place, (3, 3))
        (fx, skew, cx), (_, fy, cy), _ = matrix.tolist()
        if skew != 0.0 or (matrix != [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]).any():
            raise CaptureError(
                f"{place} is not that of a camera: it must be fx 0 cx, 0 fy cy, 0 0 1, row by row; "
                "give it as the calibration wrote it"
            )
        return matrix


def text_or_number(name: Any) -> str:
    """Return a text that YAML may have taken for a number."""
    return "" if name is None else str(name)


def pose_of(matrix: Any, place: str) -> Pose:
    """Convert a 4x4 matrix; PoseError, which names the `place`, if it is no rigid motion."""
    with located(place):
        return Pose(np.array(matrix, np.float64))


def distinct_names(names: Sequence[str], otherwise: Sequence[str]) -> list[str]:
    """Return names of cameras, or `otherwise` if one of them cannot be, or two are the same."""
    is_fit = len(set(names)) == len(names) and not any(map(name_fault, names))
    return list(names if is_fit else otherwise)


def checked(
    place: str, cameras: Sequence[MountedCamera], lengths: str = "", cure: str = ""
) -> tuple[MountedCamera, ...]:
    """Check the number of cameras, their lenses, and that they are as near as those of a rig.

    `lengths` is the key of the poses of several cameras, and `cure` how to correct a length in
    another unit.

    Raises:
        CaptureError: there are too many cameras, or two are too far from each other.
        CameraError: a focal length or a principal point is that of no calibration.

    """
    if len(cameras) > MOST_CAMERAS:
        raise CaptureError(
            f"{place} names {len(cameras)} cameras; at most {MOST_CAMERAS} are allowed"
        )
    for camera in cameras:
        check_reach(f"{place}, {camera.name}", camera.lens.focal_px, camera.lens.center_px)
    for before, camera in pairwise(cameras):
        away_m = apart_m(before, camera)
        distance = f"{place}, {lengths}: the distance of {camera.name} from {before.name}"
        absurd = implausible(distance, away_m, NEAR_M)
        if absurd is not None:
            raise CaptureError(f"{absurd}; {cure}")
    return tuple(cameras)


def apart_m(one: MountedCamera, other: MountedCamera) -> float:
    """Return the distance of two cameras."""
    return float(
        np.linalg.norm((one.rig_from_camera.inverse() @ other.rig_from_camera).translation)
    )


def given_numbers(numbers: Sequence[float]) -> str:
    """Format numbers that a message reports."""
    return f"[{', '.join(map(digits, numbers))}]"

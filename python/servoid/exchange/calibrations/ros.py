"""Reads the YAML of ROS's camera_calibration: one file a camera, two of a stereo pair."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from servoid._native import Pose
from servoid.config import convert
from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import Calibration, Info, calibration_of
from servoid.exchange.calibrations.tables import (
    Matrix,
    ToolCalibration,
    checked,
    distinct_names,
    text_or_number,
)
from servoid.source import MountedCamera

_MARKS = ("distortion_model", "projection_matrix", "rectification_matrix", "camera_name")
_MOST = 2
_NOWHERE = Matrix(rows=3, cols=3, data=(0.0,) * 9)
_UNKNOWN = Matrix(rows=3, cols=4, data=(0.0,) * 12)


class _Camera(msgspec.Struct, frozen=True, kw_only=True):
    """Holds the keys of a file; others, such as binning in a newer one, are ignored."""

    image_width: int
    image_height: int
    camera_name: Any = None
    camera_matrix: Matrix
    distortion_model: str
    distortion_coefficients: Matrix
    rectification_matrix: Matrix = _NOWHERE
    projection_matrix: Matrix = _UNKNOWN


def is_ros(data: dict[str, Any]) -> bool:
    """Return whether the content of a file is a camera's calibration by ROS."""
    return "camera_matrix" in data and any(mark in data for mark in _MARKS)


def read_ros(paths: Sequence[Path], contents: Sequence[dict[str, Any]]) -> ToolCalibration:
    """Convert the content of one file, or of the two of a pair, the first of which is the rig.

    Raises:
        CaptureError: a key is missing, a matrix is malformed, a lens model is not supported, or
            the pose of the second camera in the first is unknown.
        CameraError: the parameters describe no lens.
        PoseError: a rectification is not a rotation.

    """
    if len(paths) > _MOST:
        raise CaptureError(
            f"{len(paths)} calibrations by ROS were given; their poses are known of two cameras, "
            "which were calibrated as a pair; write a rig.toml for more"
        )
    entries = [
        convert(data, _Camera, str(path), CaptureError, known_only=False)
        for path, data in zip(paths, contents, strict=True)
    ]
    found = [_calibration(path, entry) for path, entry in zip(paths, entries, strict=True)]
    named = [text_or_number(entry.camera_name).rpartition("/")[2] for entry in entries]
    names = distinct_names(named, distinct_names([path.stem for path in paths], ("left", "right")))
    first = MountedCamera(names[0], found[0].lens, Pose.identity())
    if len(found) == 1:
        more = "of a pair, give both files, such as --calibration left.yaml+right.yaml"
        return ToolCalibration(checked(str(paths[0]), (first,)), more=more)
    first_from_second = found[0].from_other(found[1])
    if first_from_second is None:
        raise CaptureError(
            f"{paths[0]} and {paths[1]} do not have the pose of one camera in the other: P has the "
            "same offset in both; calibrate the cameras as a stereo pair"
        )
    second = MountedCamera(names[1], found[1].lens, first_from_second)
    cure = "calibrate with --square in metres"
    cameras = checked(str(paths[1]), (first, second), "projection_matrix", cure)
    return ToolCalibration(cameras)


def _calibration(path: Path, entry: _Camera) -> Calibration:
    coefficients = entry.distortion_coefficients
    count = len(coefficients.data)
    d = coefficients.shaped(f"{path}, distortion_coefficients", (1, count), (count, 1))
    info = Info(
        size_px=(entry.image_width, entry.image_height),
        model=entry.distortion_model,
        d=tuple(d.ravel().tolist()),
        k=entry.camera_matrix.camera(f"{path}, camera_matrix"),
        r=entry.rectification_matrix.shaped(f"{path}, rectification_matrix", (3, 3)),
        p=entry.projection_matrix.shaped(f"{path}, projection_matrix", (3, 4)),
    )
    return calibration_of(info, info.size_px, str(path), is_rectified=False)

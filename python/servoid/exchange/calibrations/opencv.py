"""Reads what programs with OpenCV write: as its sample of one camera, and as that of a pair."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from servoid._native import Lens, Pose
from servoid.camera import make_lens
from servoid.config import convert
from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import Info, calibration_of
from servoid.exchange.calibrations.tables import (
    Matrix,
    Size,
    ToolCalibration,
    apart_m,
    checked,
    pose_of,
)
from servoid.source import MountedCamera
from servoid.words import counted, joined, measured

_ONE, _LENSES, _POSES = "camera_matrix", ("M1", "D1", "M2", "D2"), ("R", "T")
_FISHEYE_COUNT = 4
_MM_PER_M = 1e3


class _Shared(msgspec.Struct, frozen=True, kw_only=True):
    """Holds what is true of all lenses of a file; other keys, such as the flags, are ignored."""

    image_width: int | None = None
    image_height: int | None = None
    fisheye_model: int | None = None


class _One(_Shared, frozen=True, kw_only=True):
    """Holds the keys of one camera."""

    matrix: Matrix = msgspec.field(name=_ONE)
    distortion: Matrix = msgspec.field(name="distortion_coefficients")


class _Pair(_Shared, frozen=True, kw_only=True):
    """Holds the keys of two cameras, and of the pose of the first in the second."""

    first_matrix: Matrix = msgspec.field(name="M1")
    first_distortion: Matrix = msgspec.field(name="D1")
    second_matrix: Matrix = msgspec.field(name="M2")
    second_distortion: Matrix = msgspec.field(name="D2")
    rotation: Matrix = msgspec.field(name="R")
    translation: Matrix = msgspec.field(name="T")


def is_opencv(data: dict[str, Any]) -> bool:
    """Return whether the content of a file has keys of OpenCV's samples."""
    return any(key in data for key in (_ONE, *_LENSES)) or all(key in data for key in _POSES)


def read_opencv(
    paths: Sequence[Path], contents: Sequence[dict[str, Any]], sizes_px: Sequence[Size] | None
) -> ToolCalibration:
    """Convert the content of one file or of several, such as intrinsics.yml and extrinsics.yml.

    If it has no size of images, all images of `sizes_px` must have the same one.

    Raises:
        CaptureError: a key is missing or given twice, a matrix is malformed, or the lens or the
            size of images is not certain.
        CameraError: the parameters describe no lens.
        PoseError: the pose of the first camera in the second is not a rigid motion.

    """
    place = " and ".join(map(str, paths))
    data = _joined(place, contents)
    return (_one if _ONE in data else _pair)(place, data, sizes_px)


def _one(place: str, data: dict[str, Any], sizes_px: Sequence[Size] | None) -> ToolCalibration:
    given = convert(data, _One, place, CaptureError, known_only=False)
    size_px, notes = _size_px(place, given, sizes_px)
    keys = f"{place}, {_ONE}", f"{place}, distortion_coefficients"
    lens = _lens(keys, (given.matrix, given.distortion), size_px, given)
    more = f"of a pair, give a file with {', '.join((*_LENSES, *_POSES))}"
    camera = MountedCamera("camera", lens, Pose.identity())
    return ToolCalibration(checked(place, (camera,)), notes, more)


def _pair(place: str, data: dict[str, Any], sizes_px: Sequence[Size] | None) -> ToolCalibration:
    _check_whole(place, data)
    given = convert(data, _Pair, place, CaptureError, known_only=False)
    size_px, notes = _size_px(place, given, sizes_px)
    first, second = (
        _lens((f"{place}, M{number}", f"{place}, D{number}"), matrices, size_px, given)
        for number, matrices in (
            (1, (given.first_matrix, given.first_distortion)),
            (2, (given.second_matrix, given.second_distortion)),
        )
    )
    second_from_first = np.eye(4)
    second_from_first[:3, :3] = given.rotation.shaped(f"{place}, R", (3, 3))
    second_from_first[:3, 3] = given.translation.shaped(f"{place}, T", (3, 1), (1, 3)).ravel()
    left = MountedCamera("left", first, Pose.identity())
    right = MountedCamera("right", second, pose_of(second_from_first, f"{place}, R").inverse())
    cure = "T is in the unit of the board's squares, so calibrate with their side in metres"
    apart = measured(_MM_PER_M * apart_m(left, right))
    note = f"the cameras of {place} are {apart} mm apart, if its T is in metres"
    return ToolCalibration(checked(place, (left, right), "T", cure), (*notes, note))


def _joined(place: str, contents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Combine the tables of several files."""
    data: dict[str, Any] = {}
    for table in contents:
        twice = next((key for key in table if key in data), None)
        if twice is not None:
            raise CaptureError(
                f"{place} both have '{twice}'; give the lenses of a pair, M1 D1 M2 D2, and the "
                "pose of its cameras, R T, once each"
            )
        data |= table
    return data


def _check_whole(place: str, data: dict[str, Any]) -> None:
    """Check that both the lenses and the poses of a pair are there."""
    lacking = [key for key in (*_LENSES, *_POSES) if key not in data]
    if lacking:
        raise CaptureError(
            f"{place}: {joined(lacking)} {'is' if len(lacking) == 1 else 'are'} missing; a pair "
            f"has {', '.join((*_LENSES, *_POSES))}; if they are in two files, give both, such as "
            "--calibration intrinsics.yml+extrinsics.yml"
        )


def _size_px(
    place: str, given: _Shared, sizes_px: Sequence[Size] | None
) -> tuple[Size, tuple[str, ...]]:
    """Return the size of images, with a note if it is that of the source."""
    if given.image_width is not None and given.image_height is not None:
        return (given.image_width, given.image_height), ()
    if not sizes_px or len(set(sizes_px)) > 1:
        raise CaptureError(
            f"{place} does not say for which size of images it is valid; add image_width and "
            "image_height, such as image_width: 640"
        )
    width, height = sizes_px[0]
    note = f"there is no size of images in {place}; {width}x{height} pixels are taken"
    return (width, height), (note,)


def _lens(
    places: tuple[str, str], matrices: tuple[Matrix, Matrix], size_px: Size, given: _Shared
) -> Lens:
    """Make a lens of a camera matrix and of its distortion, each with the place of its key."""
    k = matrices[0].camera(places[0])
    count = len(matrices[1].data)
    d = matrices[1].shaped(places[1], (count, 1), (1, count)).ravel().tolist()
    if count == _FISHEYE_COUNT and given.fisheye_model is None:
        raise CaptureError(
            f"{places[1]}: four numbers are those of calibrateCamera or of fisheye.calibrate; add "
            "the key fisheye_model, 0 for the first and 1 for the second"
        )
    if count != _FISHEYE_COUNT and given.fisheye_model:
        raise CaptureError(
            f"{places[1]}: {counted(count, 'number was', 'numbers were')} given; a fisheye has "
            f"{_FISHEYE_COUNT}; correct them"
        )
    if given.fisheye_model:
        return make_lens(
            places[0],
            model="kannala_brandt",
            size_px=size_px,
            focal_px=(float(k[0, 0]), float(k[1, 1])),
            center_px=(float(k[0, 2]), float(k[1, 2])),
            distortion=d,
        )
    info = Info(size_px=size_px, model="rational_polynomial", d=tuple(d), k=k)
    return calibration_of(info, size_px, places[0], is_rectified=False).lens

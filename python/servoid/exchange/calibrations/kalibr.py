"""Reads Kalibr's camchain.yaml: lenses, and the pose of each camera in the next one."""

import re
from pathlib import Path
from typing import Any

import msgspec

from servoid._native import Lens, Pose
from servoid.camera import make_lens
from servoid.capture import Row
from servoid.config import convert
from servoid.errors import CaptureError
from servoid.exchange.bags.names import namespace_of, short_names
from servoid.exchange.calibrations.tables import (
    ToolCalibration,
    checked,
    distinct_names,
    given_numbers,
    pose_of,
)
from servoid.source import MountedCamera
from servoid.words import counted

_CAMERA = re.compile(r"cam[0-9]+")
_STEP = "T_cn_cnm1"
_INTRINSICS = 4
_MODELS = {
    "radtan": ("brown_conrady", 4),
    "equi": ("kannala_brandt", 4),
    "none": ("pinhole", 0),
}


class _Camera(msgspec.Struct, frozen=True, kw_only=True):
    """Holds the keys of one camera that determine its lens and its pose; others are ignored."""

    camera_model: str
    intrinsics: tuple[float, ...]
    distortion_model: str
    distortion_coeffs: tuple[float, ...] = ()
    resolution: tuple[int, int]
    step: tuple[Row, Row, Row, Row] | None = msgspec.field(default=None, name=_STEP)
    rostopic: Any = None


def is_kalibr(data: dict[str, Any]) -> bool:
    """Return whether the content of a file is a chain of cameras."""
    return any(map(_CAMERA.fullmatch, data))


def read_kalibr(path: Path, data: dict[str, Any]) -> ToolCalibration:
    """Convert the content of a camchain.yaml.

    Raises:
        CaptureError: a key is missing, a lens model is not supported, or a camera is missing.
        CameraError: the parameters describe no lens.
        PoseError: the pose of a camera in the next one is not a rigid motion.

    """
    keys = [key for key in data if _CAMERA.fullmatch(key)]
    chain = [f"cam{number}" for number in range(len(keys))]
    if set(keys) != set(chain):
        raise CaptureError(
            f"{path} has {', '.join(keys)}; the cameras of a chain must be {', '.join(chain)}"
        )
    entries = [_entry(path, key, data[key]) for key in chain]
    spaces = [namespace_of(str(entry.rostopic or "")) for entry in entries]
    names = distinct_names(short_names(spaces), chain) if all(spaces) else chain
    rig_from_camera = Pose.identity()
    cameras = []
    for index, (key, name, entry) in enumerate(zip(chain, names, entries, strict=True)):
        place = f"{path}, {key}"
        if index > 0:
            if entry.step is None:
                raise CaptureError(
                    f"{place}: {_STEP} is missing, the pose of {chain[index - 1]} in {key}; give "
                    "the camchain.yaml of a calibration of all cameras together"
                )
            rig_from_camera = rig_from_camera @ pose_of(entry.step, f"{place}, {_STEP}").inverse()
        cameras.append(MountedCamera(name, _lens(place, entry), rig_from_camera))
    cure = "Kalibr's lengths are metres if the file of its target is in metres"
    return ToolCalibration(checked(str(path), cameras, _STEP, cure))


def _entry(path: Path, key: str, table: Any) -> _Camera:
    if not isinstance(table, dict):
        raise CaptureError(f"{path}, {key}: expected a table of keys and values")
    return convert(table, _Camera, f"{path}, {key}", CaptureError, known_only=False)


def _lens(place: str, entry: _Camera) -> Lens:
    if entry.camera_model != "pinhole" or entry.distortion_model not in _MODELS:
        raise CaptureError(
            f"{place}: its lens is '{entry.camera_model}' with '{entry.distortion_model}'; servoid "
            f"supports 'pinhole' with {', '.join(map(repr, _MODELS))}; calibrate again with "
            "--models pinhole-radtan or, for a wide lens, pinhole-equi"
        )
    model, count = _MODELS[entry.distortion_model]
    if len(entry.intrinsics) != _INTRINSICS:
        raise CaptureError(
            f"{place}, intrinsics: {given_numbers(entry.intrinsics)} are not the four of a pinhole "
            "camera: fu, fv, pu, pv; correct them"
        )
    given = entry.distortion_coeffs
    if len(given) != count and (count > 0 or any(given)):
        raise CaptureError(
            f"{place}, distortion_coeffs: {counted(len(given), 'number was', 'numbers were')} "
            f"given; '{entry.distortion_model}' has {count}; correct them"
        )
    fx, fy, cx, cy = entry.intrinsics
    return make_lens(
        place,
        model=model,
        size_px=entry.resolution,
        focal_px=(fx, fy),
        center_px=(cx, cy),
        distortion=given[:count],
    )

"""Reads a file with a calibration that the user supplies: servoid's own, or another program's."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import msgspec

from servoid.capture import LensEntry, Version, mounted_lenses, read_versioned
from servoid.errors import CaptureError
from servoid.exchange import ToolCalibration, read_tool_calibration
from servoid.source import MountedCamera
from servoid.words import counted

Size = tuple[int, int]


class _CameraEntry(LensEntry, frozen=True, kw_only=True):
    """Holds one [[camera]] table of a calibration; further keys of a capture or rig are ignored."""

    images: Any = None
    masks: Any = None
    depths: Any = None
    depth_scale_m: Any = None
    device: Any = None
    lock: Any = None
    controls: Any = None


class _CalibrationFile(msgspec.Struct, frozen=True, kw_only=True):
    """Holds a calibration: a rig.toml or a capture.toml, of which only the cameras are used."""

    version: Version
    camera: Annotated[tuple[_CameraEntry, ...], msgspec.Meta(min_length=1)]
    rate_hz: Any = None
    metric: Any = None
    rig: Any = None


def read_calibration(
    paths: Sequence[Path], source: str, names: Sequence[str], sizes_px: Sequence[Size] | None
) -> tuple[tuple[MountedCamera, ...], tuple[str, ...]]:
    """Return the cameras of a calibration, and messages for the user.

    The cameras are in the order of `names` where their names are equal, else in the calibration's.
    Of another program's, which has no rig, the first of them is the rig's origin.

    Raises:
        CaptureError: the calibration is damaged or incomplete, or is that of other cameras.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: the pose of a camera is not a rigid motion.

    """
    path = " and ".join(map(str, paths))
    tool = read_tool_calibration(paths, sizes_px)
    found = tool or _own(paths[0])
    cameras = list(found.cameras)
    if len(cameras) != len(names):
        cure = "give the calibration of those that took it"
        if found.more and len(cameras) < len(names):
            cure = found.more
        elif len(cameras) > len(names):
            cure = (
                "give what the others recorded as well, joined by plus, or the calibration of "
                f"{counted(len(names), 'camera')}"
            )
        raise CaptureError(
            f"{path} is of {counted(len(cameras), 'camera')}, but {source} has {len(names)}; {cure}"
        )
    if {camera.name for camera in cameras} == set(names):
        cameras.sort(key=lambda camera: names.index(camera.name))
    if tool is not None and cameras[0] is not found.cameras[0]:
        cameras = _from_first(cameras)
    for camera, size_px in zip(cameras, sizes_px or (), strict=False):
        if camera.lens.size_px != tuple(size_px):
            raise CaptureError(
                f"{path}, camera '{camera.name}': size_px = {list(camera.lens.size_px)}, but the "
                f"images of {source} have {size_px[0]}x{size_px[1]} pixels; give the calibration "
                "that was made for this size"
            )
    return tuple(cameras), found.notes


def _from_first(cameras: Sequence[MountedCamera]) -> list[MountedCamera]:
    """Return cameras on a rig whose origin is the first of them."""
    first_from_rig = cameras[0].rig_from_camera.inverse()
    return [
        replace(camera, rig_from_camera=first_from_rig @ camera.rig_from_camera)
        for camera in cameras
    ]


def _own(path: Path) -> ToolCalibration:
    """Read the cameras of a TOML file."""
    file, text = read_versioned(path, _CalibrationFile, "calibrations")
    return ToolCalibration(
        tuple(
            MountedCamera(entry.name, mounted.lens, mounted.rig_from_camera)
            for entry, mounted in zip(
                file.camera, mounted_lenses(path, file.camera, text), strict=True
            )
        )
    )

"""Reads a rig's file: its live cameras, their lenses and their poses on the rig."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from servoid._native import Pose
from servoid.capture import LensEntry, Row, Version, mounted_lenses, read_versioned
from servoid.config import is_file, name_fault
from servoid.errors import CaptureError, located
from servoid.source.controls import Controls
from servoid.source.grabbing import Video
from servoid.source.live import LiveCamera

_REALSENSE = "realsense:"


class _LiveEntry(LensEntry, frozen=True, kw_only=True):
    """Holds one [[camera]] table of a rig's file."""

    device: int | Annotated[str, msgspec.Meta(min_length=1)]
    controls: Controls | None = None


class _PairEntry(msgspec.Struct, frozen=True, kw_only=True):
    """Holds one [[pair]] table: a device that has the calibration of its two eyes."""

    name: Annotated[str, msgspec.Meta(min_length=1, examples=["head"])]
    device: Annotated[str, msgspec.Meta(min_length=1, examples=["realsense:123456"])]
    rig_from_left: tuple[Row, Row, Row, Row] | None = None
    controls: Controls | None = None


class _RigFile(msgspec.Struct, frozen=True, kw_only=True):
    """Holds a whole rig's file of version 1."""

    version: Version
    camera: tuple[_LiveEntry, ...] = ()
    pair: tuple[_PairEntry, ...] = ()


def read_rig(path: str | Path) -> tuple[LiveCamera, ...]:
    """Read the cameras of a live rig: a capture.toml with `device` in place of `images`.

    The devices of [[pair]] tables are opened, since the calibration of their eyes is in them.

    Raises:
        CaptureError: the file is missing or malformed, two cameras share a name, a device is a
            recorded file, or the device of a pair cannot be opened.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: a `rig_from_camera` or `rig_from_left` is not a rigid motion.
        MissingExtraError: the driver's library of a pair is not installed.

    """
    path = Path(path)
    file, text = read_versioned(path, _RigFile, "rigs")
    _check(path, file)
    lenses = mounted_lenses(path, file.camera, text)
    cameras = [
        LiveCamera(entry.name, entry.device, mounted.lens, mounted.rig_from_camera, entry.controls)
        for entry, mounted in zip(file.camera, lenses, strict=True)
    ]
    with ExitStack() as opened:
        for entry in file.pair:
            eyes = _open_pair(path, entry)
            if isinstance(eyes[0].device, Video):
                opened.callback(eyes[0].device.release)
            cameras.extend(eyes)
        names = [camera.name for camera in cameras]
        for name in names:
            if names.count(name) > 1:
                raise CaptureError(f"{path}: two cameras are named '{name}'; rename one of them")
        opened.pop_all()  # all are open; the caller closes them
    return tuple(cameras)


def _check(path: Path, file: _RigFile) -> None:
    for entry in file.camera:
        # OpenCV would deliver the images of a file as fast as it decodes them.
        if isinstance(entry.device, str) and is_file(Path(entry.device)):
            raise CaptureError(
                f"{path}, camera '{entry.name}': device is '{entry.device}', which is a file and "
                "not a live camera; give a camera's number, a /dev/ file or an address, or name "
                "the video as images in a capture.toml"
            )
    for fault in (name_fault(entry.name) for entry in file.pair):
        if fault is not None:
            raise CaptureError(f"{path}: {fault}")
    count = len(file.camera) + len(file.pair)
    if count == 0:
        raise CaptureError(
            f"{path} names no camera; write a [[camera]] table, or [[pair]] with device = "
            '"realsense:SERIAL"'
        )
    if count == 1:
        return
    for kind, key, entries in (
        ("camera", "rig_from_camera", [(e.name, e.rig_from_camera) for e in file.camera]),
        ("pair", "rig_from_left", [(e.name, e.rig_from_left) for e in file.pair]),
    ):
        for name, pose in entries:
            if pose is None:
                raise CaptureError(
                    f"{path}, {kind} '{name}': {key} is missing; the only one on a rig needs "
                    "none, but each of several needs its pose, as a 4x4 matrix"
                )


def _open_pair(path: Path, entry: _PairEntry) -> list[LiveCamera]:
    """Open a pair; its eyes are named by the pair's name and their own."""
    place = f"{path}, pair '{entry.name}'"
    if not entry.device.startswith(_REALSENSE):
        raise CaptureError(
            f"{place}: device is '{entry.device}'; a pair with a calibration of its own is "
            f"{_REALSENSE}SERIAL; other cameras have a [[camera]] table each"
        )
    rig_from_left = Pose.identity()
    if entry.rig_from_left is not None:
        with located(f"{place}, rig_from_left"):
            rig_from_left = Pose(np.array(entry.rig_from_left, dtype=np.float64))
    from servoid.source.devices import open_realsense

    eyes = open_realsense(entry.device.removeprefix(_REALSENSE), entry.controls)
    return [
        replace(
            eye,
            name=f"{entry.name}_{eye.name}",
            rig_from_camera=rig_from_left @ eye.rig_from_camera,
        )
        for eye in eyes
    ]

"""Reads from a file which live cameras there are, how they see and where they sit on their rig."""

from pathlib import Path
from typing import Annotated

import msgspec

from servoid.capture.capture_file import LensEntry, Version, mounted_lenses, read_versioned
from servoid.source.controls import Controls
from servoid.source.live import LiveCamera


class _LiveEntry(LensEntry, frozen=True, kw_only=True):
    """Holds one [[camera]] table of a rig's file."""

    device: int | Annotated[str, msgspec.Meta(min_length=1)]
    controls: Controls | None = None


class _RigFile(msgspec.Struct, frozen=True, kw_only=True):
    """Holds a whole rig's file of version 1."""

    version: Version
    camera: Annotated[tuple[_LiveEntry, ...], msgspec.Meta(min_length=1)]


def read_rig(path: str | Path) -> tuple[LiveCamera, ...]:
    """Read the cameras of a live rig: a capture.toml with `device` in place of `images`.

    Raises:
        CaptureError: the file is missing or malformed, or two cameras have one name.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: a `rig_from_camera` is no rigid motion.

    """
    file, text = read_versioned(Path(path), _RigFile, "rigs")
    lenses = mounted_lenses(Path(path), file.camera, text)
    return tuple(
        LiveCamera(entry.name, entry.device, mounted.lens, mounted.rig_from_camera, entry.controls)
        for entry, mounted in zip(file.camera, lenses, strict=True)
    )

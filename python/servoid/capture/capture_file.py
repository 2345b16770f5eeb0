"""The structure of `capture.toml` and `poses.csv`, and their readers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
import numpy as np

from servoid._native import Camera, Lens, Pose
from servoid.camera import make_lens
from servoid.config import (
    MOST_CAMERAS,
    POSES_FILE,
    check_version,
    convert,
    line_of,
    name_fault,
    read_text,
    read_toml_text,
)
from servoid.errors import CameraError, CaptureError, located
from servoid.words import counted, digits, number_of

_FOCAL_PX = (1e-3, 1e9)  # of any lens: beyond, the image is a point, or all rays are parallel
_MOST_HZ = 10_000.0  # of a recording

POSES_HEADER = ("time_s", "x", "y", "z", "qw", "qx", "qy", "qz")

Row = tuple[float, float, float, float]
FileT = TypeVar("FileT", bound=msgspec.Struct)


Version = Annotated[int, msgspec.Meta(examples=[1])]


class LensEntry(msgspec.Struct, frozen=True, kw_only=True):
    """Holds the keys of a [[camera]] table that describe the camera itself.

    Either `focal_px` or `fov_deg` is given. `center_px` defaults to the image centre. The only
    camera of a rig needs no `rig_from_camera`: it is the rig's origin.
    """

    name: Annotated[str, msgspec.Meta(min_length=1, examples=["eye"])]
    size_px: Annotated[tuple[int, int], msgspec.Meta(examples=[[640, 480]])]
    model: str = "pinhole"
    focal_px: tuple[float, float] | None = None
    fov_deg: float | None = None
    center_px: tuple[float, float] | None = None
    distortion: tuple[float, ...] = ()
    rig_from_camera: tuple[Row, Row, Row, Row] | None = None


class CameraEntry(LensEntry, frozen=True, kw_only=True):
    """Holds one [[camera]] table of capture.toml."""

    images: Annotated[str, msgspec.Meta(min_length=1, examples=["images/*.jpg"])]
    masks: Annotated[str, msgspec.Meta(min_length=1)] | None = None
    depths: Annotated[str, msgspec.Meta(min_length=1)] | None = None
    depth_scale_m: Annotated[float, msgspec.Meta(gt=0)] | None = None


class RigEntry(msgspec.Struct, frozen=True, kw_only=True):
    """Holds the [rig] table of capture.toml; without poses the rig is at the world's origin."""

    poses: Annotated[str, msgspec.Meta(min_length=1)] | None = None


class CaptureFile(msgspec.Struct, frozen=True, kw_only=True):
    """Holds a whole capture.toml of version 1; with `metric` false lengths are not in metres."""

    version: Version
    rate_hz: Annotated[float, msgspec.Meta(gt=0)] | None = None
    camera: Annotated[tuple[CameraEntry, ...], msgspec.Meta(min_length=1)]
    rig: RigEntry = RigEntry()
    metric: bool = True

    @property
    def is_uncalibrated(self) -> bool:
        """Return whether the file calibrates none of its cameras."""
        return all(entry.focal_px is None and entry.fov_deg is None for entry in self.camera)


@dataclass(frozen=True)
class MountedLens:
    """The calibration of one [[camera]] table: the lens, and the camera's pose on the rig."""

    lens: Lens
    rig_from_camera: Pose


CalibrationSupplier = Callable[[Sequence[str], Sequence[tuple[int, int]]], Sequence[MountedLens]]
"""Returns the calibration of cameras, given their names and image sizes (width, height)."""


def read_capture_file(
    path: Path, supplier: CalibrationSupplier | None = None
) -> tuple[CaptureFile, tuple[MountedLens, ...]]:
    """Read and check a capture.toml; return its content, and its cameras in order.

    If the file calibrates none of its cameras, as for a recording before calibration, `supplier`
    supplies the calibration. Otherwise `supplier` must be None.

    Raises:
        CaptureError: the file is missing or malformed, or a key is unknown.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: a `rig_from_camera` is not a rigid motion.

    """
    file, text = read_versioned(path, CaptureFile, "captures")
    _check_rate(path, file.rate_hz)
    for entry in file.camera:
        if entry.depths is not None and entry.depth_scale_m is None:
            raise CaptureError(
                f"{path}, camera '{entry.name}': depths needs depth_scale_m, one unit of the "
                "files in metres; write depth_scale_m = 0.001 for millimetres, or 1.0 for metres"
            )
    if supplier is None:
        return file, mounted_lenses(path, file.camera, text)
    if not file.is_uncalibrated:
        raise CaptureError(f"{path} has its own calibration; leave the given calibration out")
    names = [entry.name for entry in file.camera]
    _check_names(path, names)
    return file, tuple(supplier(names, [entry.size_px for entry in file.camera]))


def _check_rate(path: Path, rate_hz: float | None) -> None:
    """Check that a rate is that of a camera; that of a time lapse may be as low as any."""
    if rate_hz is None or rate_hz <= _MOST_HZ:
        return
    raise CaptureError(
        f"{path}: rate_hz is {digits(rate_hz)}; give the observations per second, at most "
        f"{digits(_MOST_HZ)}; if that is a number for 1000 seconds, write {digits(rate_hz / 1e3)}"
    )


def read_versioned(path: Path, struct: type[FileT], kind: str) -> tuple[FileT, str]:
    """Read a TOML file of version 1, of a `kind` such as captures; return it with its text.

    Raises:
        CaptureError: the file is missing or malformed, or a key is unknown.

    """
    data, text = read_toml_text(path, CaptureError)
    if "version" in data:  # without one, the next step reports all missing keys together
        check_version(data, str(path), CaptureError, kind)
    return convert(data, struct, str(path), CaptureError, text), text


def mounted_lenses(path: Path, entries: Sequence[LensEntry], text: str) -> tuple[MountedLens, ...]:
    """Return the calibrations in the [[camera]] tables of a file whose content is `text`.

    Raises:
        CaptureError: two cameras share a name, or one has a name that cannot be; there are too
            many, or a calibration is incomplete.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: a `rig_from_camera` is not a rigid motion.

    """
    if len(entries) > MOST_CAMERAS:
        raise CaptureError(
            f"{path} names {len(entries)} cameras; at most {MOST_CAMERAS} are allowed"
        )
    _check_names(path, [entry.name for entry in entries])
    mounted = []
    for index, entry in enumerate(entries):
        place = f"{path}, camera '{entry.name}'"
        if entry.rig_from_camera is None and len(entries) > 1:
            raise CaptureError(
                f"{place}: rig_from_camera is missing; the only camera of a rig needs none, but "
                f"each of {len(entries)} needs its pose on the rig, as a 4x4 matrix"
            )
        mounted.append(_read_lens(entry, place, line_of(text, "rig_from_camera", index)))
    return tuple(mounted)


def _check_names(path: Path, names: Sequence[str]) -> None:
    for name in names:
        fault = name_fault(name)
        if fault is not None:
            raise CaptureError(f"{path}: {fault}")
        if names.count(name) > 1:
            raise CaptureError(f"{path}: two cameras are named '{name}'; give each its own name")


def _read_lens(entry: LensEntry, place: str, pose_line: int | None) -> MountedLens:
    focal_px, middle_px = _focal_and_middle(entry, place)
    check_reach(place, focal_px, entry.center_px or middle_px)
    lens = make_lens(
        place,
        model=entry.model,
        size_px=entry.size_px,
        focal_px=focal_px,
        center_px=middle_px if entry.center_px is None else entry.center_px,
        distortion=entry.distortion,
    )
    if entry.rig_from_camera is None:
        return MountedLens(lens, Pose.identity())
    line = f", line {pose_line}" if pose_line else ""
    with located(f"{place}, rig_from_camera{line}"):
        return MountedLens(lens, Pose(np.array(entry.rig_from_camera, dtype=np.float64)))


def check_reach(place: str, focal_px: Sequence[float], center_px: Sequence[float]) -> None:
    """Refuse numbers that no calibration has; the core accepts any, but images are then useless.

    Raises:
        CameraError: a focal length or the principal point is out of range.

    """
    least, most = _FOCAL_PX
    if any(0.0 < focal < least or focal > most for focal in focal_px):
        raise CameraError(
            f"{place}: a focal length must be a positive number of pixels, {least:g} to {most:g}, "
            f"but focal_px is {[float(f'{focal:.6g}') for focal in focal_px]}"
        )
    if max(map(abs, center_px)) > most:
        raise CameraError(
            f"{place}: the principal point must be within {most:g} pixels, but center_px is "
            f"{[float(f'{middle:.6g}') for middle in center_px]}"
        )


def _focal_and_middle(
    entry: LensEntry, place: str
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the focal lengths and the principal point, in pixels."""
    width, height = entry.size_px
    if entry.focal_px is not None and entry.fov_deg is None:
        return entry.focal_px, ((width - 1) / 2.0, (height - 1) / 2.0)
    if entry.fov_deg is None or entry.focal_px is not None:
        raise CaptureError(
            f"{place}: give focal_px, two focal lengths in pixels from a calibration, or fov_deg, "
            "the angle of view from the left to the right border; one of them, not both. For a "
            "recording without any calibration, track and model take --fov or "
            "--calibration, and servoid scan estimates it"
        )
    if entry.model == "kannala_brandt":
        raise CaptureError(
            f"{place}: fov_deg does not determine a fisheye; calibrate it, and give focal_px"
        )
    with located(f"{place}, fov_deg"):
        camera = Camera.from_fov(entry.size_px, entry.fov_deg)
    return camera.focal_px, camera.center_px


def read_poses(path: Path) -> tuple[list[float], list[Pose]]:
    """Read a poses.csv: the times in seconds, and `world_from_rig` at each.

    Raises:
        CaptureError: the file is missing, or a line is malformed.
        PoseError: a line is not a rigid motion; the message names file and line.

    """
    text = read_text(path, CaptureError, POSES_FILE)
    lines = text.splitlines() or [""]
    header = tuple(cell.strip() for cell in lines[0].split(","))
    if header != POSES_HEADER:
        raise CaptureError(
            f"{path}, line 1: the header is '{','.join(header)}'; it must be "
            f"'{','.join(POSES_HEADER)}'"
        )
    rows = [
        _read_pose(line.split(","), f"{path}, line {number}")
        for number, line in enumerate(lines[1:], start=2)
        if line.strip()
    ]
    return [time_s for time_s, _ in rows], [pose for _, pose in rows]


def _read_pose(cells: list[str], place: str) -> tuple[float, Pose]:
    if len(cells) != len(POSES_HEADER):
        raise CaptureError(
            f"{place}: {counted(len(cells), 'value was', 'values were')} given; a pose has "
            f"{len(POSES_HEADER)}: "
            f"{','.join(POSES_HEADER)}"
        )
    numbers = []
    for name, cell in zip(POSES_HEADER, cells, strict=True):
        try:
            numbers.append(number_of(cell))
        except ValueError as error:
            raise CaptureError(f"{place}: {name} is '{cell}'; write a number") from error
    if not np.isfinite(numbers[0]):
        raise CaptureError(f"{place}: time_s is {cells[0]}; write a finite number of seconds")
    with located(place):
        return numbers[0], Pose.from_parts(numbers[1:4], numbers[4:8])

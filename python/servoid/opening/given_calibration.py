"""Calibration that the user supplies: a calibration file, or an angle of view."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import msgspec

from servoid._native import Camera, Pose
from servoid.brief import brief
from servoid.camera import pinhole_lens
from servoid.capture import LensEntry, Version, mounted_lenses, read_versioned
from servoid.config import NEAR_M, SETTINGS_FILE, implausible, read_text
from servoid.errors import CaptureError, located
from servoid.source import MountedCamera
from servoid.words import counted, digits

Size = tuple[int, int]
_RATE = "--rate"
_ANY_FOV_DEG, _ANY_BASELINE_M = 60.0, 1.0  # where only the images matter
_ANY_SIZE_PX = (640, 480)
_MARKED = 4096  # first characters of another program's calibration, which show whose it is
_TOOLS = {
    "T_cn_cnm1": "Kalibr",
    "distortion_coeffs": "Kalibr",
    "opencv-matrix": "OpenCV",
    "opencv_storage": "OpenCV",
    "distortion_model": "ROS",
    "camera_matrix": "ROS",
    "Camera list with one line of data per camera": "COLMAP",
    "<document": "Metashape",
    "camera_angle_x": "nerfstudio",
}


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


@dataclass(frozen=True)
class Rig:
    """The cameras of a source, and the assumptions about them, as messages for the user.

    Unless `is_seated`, only their lenses are known, and not their poses on the rig. If
    `is_made_up`, only the images matter, and distances between the cameras have no meaning.
    """

    cameras: tuple[MountedCamera, ...]
    notes: tuple[str, ...] = ()
    is_seated: bool = True
    is_made_up: bool = False

    __repr__ = brief


@dataclass(frozen=True, kw_only=True)
class GivenCalibration:
    """The calibration that a user supplies for cameras whose images come without one.

    `fov_deg` is the angle of view from the left to the right border of the image, in degrees.
    `baseline_m` is the distance of the right one of two parallel cameras from the left one, in
    metres. `calibration` is a TOML file with [[camera]] tables, such as a rig.toml. `rate_hz` is
    the number of images per second where the source does not state it. With `is_any`, only the
    images matter, and cameras without a calibration may have any lens and pose.

    Raises:
        CameraError: the angle of view is that of no pinhole camera.
        CaptureError: another value is out of range, or two contradict each other.

    """

    fov_deg: float | None = None
    baseline_m: float | None = None
    calibration: Path | None = None
    rate_hz: float | None = None
    is_any: bool = False

    def __post_init__(self) -> None:
        if self.fov_deg is not None:
            with located("--fov"):
                Camera.from_fov(_ANY_SIZE_PX, self.fov_deg)
        for option, value in (("--baseline", self.baseline_m), ("--rate", self.rate_hz)):
            if value is not None and not 0.0 < value < math.inf:
                raise CaptureError(f"{option} is {digits(value)}; give a positive number")
        absurd = implausible("--baseline", self.baseline_m or 0.0, NEAR_M)
        if absurd is not None:
            raise CaptureError(absurd)
        if self.calibration is not None and (self.fov_deg or self.baseline_m):
            raise CaptureError(
                "--calibration gives the lenses and the poses on the rig; leave --fov and "
                "--baseline out"
            )

    def refuse(self, source: str) -> None:
        """Check that no calibration is supplied for a source that has its own.

        Raises:
            CaptureError: one is supplied.

        """
        for option in self.given():
            if option != _RATE:
                raise CaptureError(f"{source} has its own calibration; leave {option} out")

    @property
    def supplies_calibration(self) -> bool:
        """Return whether any calibration is supplied, not only a rate."""
        return self.is_any or any(option != _RATE for option in self.given())

    @property
    def supplies_lens(self) -> bool:
        """Return whether a camera's lens is supplied, not only its pose or a rate."""
        return self.fov_deg is not None or self.calibration is not None

    def given(self) -> list[str]:
        """List the options that were given."""
        values = {"--fov": self.fov_deg, "--baseline": self.baseline_m}
        values |= {"--calibration": self.calibration, _RATE: self.rate_hz}
        return [option for option, value in values.items() if value is not None]

    def rig(
        self,
        source: str,
        names: Sequence[str],
        sizes_px: Sequence[Size] | None,
        *,
        is_placed: bool = False,
    ) -> Rig:
        """Return the cameras of a source, given their names and sizes (width, height).

        Without sizes, the calibration supplies them. With `is_placed` the source has the poses of
        its cameras: then only lenses need be supplied.

        Raises:
            CaptureError: the calibration is incomplete, or is that of other cameras.
            CameraError: a camera cannot exist.

        """
        if self.calibration is not None:
            return Rig(_calibrated(self.calibration, source, names, sizes_px))
        fov_deg = _ANY_FOV_DEG if self.fov_deg is None and self.is_any else self.fov_deg
        if fov_deg is None or sizes_px is None:
            cameras = "its camera" if len(names) == 1 else "its cameras"
            raise CaptureError(
                f"{source}: there is no calibration of {cameras}; {remedies(len(names))}"
            )
        if self.baseline_m is not None or not (is_placed or self.is_any):
            self._check_seats(source, len(names))
        with located("--fov"):
            cameras = [Camera.from_fov(size_px, fov_deg) for size_px in sizes_px]
        apart_m = self.baseline_m or _ANY_BASELINE_M
        return Rig(
            tuple(
                MountedCamera(name, pinhole_lens(camera), _beside(place * apart_m))
                for place, (name, camera) in enumerate(zip(names, cameras, strict=True))
            ),
            () if self.fov_deg is None else (self._assumption(cameras[0], is_placed=is_placed),),
            is_seated=self.baseline_m is not None or not is_placed,
            is_made_up=len(names) > 1 and self.baseline_m is None and not is_placed,
        )

    def _check_seats(self, source: str, count: int) -> None:
        """Check that the poses of cameras without a calibration follow from a baseline."""
        if count > 2 or (count == 2 and self.baseline_m is None):
            others = ", or --baseline for two parallel cameras" if count == 2 else ""
            raise CaptureError(
                f"{source}: the poses of its {count} cameras are unknown; give --calibration FILE"
                f"{others}"
            )
        if count == 1 and self.baseline_m is not None:
            raise CaptureError(
                f"{source} has one camera, so --baseline does not apply; leave it out"
            )

    def _assumption(self, camera: Camera, *, is_placed: bool) -> str:
        """Describe what an angle of view means for the first camera."""
        width, height = camera.size_px
        seen = (
            f"{width}x{height} pixels cover {digits(self.fov_deg or 0.0)} degrees from left to "
            f"right, a focal length of {digits(round(camera.focal_px[0], 1))} px, without "
            "distortion, with the principal point at the image centre"
        )
        if self.baseline_m is not None:
            apart = f"{digits(self.baseline_m)} m apart"
            return f"{seen}; two such cameras are parallel, {apart}"
        return seen if is_placed else f"{seen}; the camera is the world's origin"


def any_cameras(known: GivenCalibration) -> GivenCalibration:
    """Return the calibration for cameras without one, where only their images matter."""
    return replace(known, is_any=True)


def _tool_of(path: Path) -> str | None:
    """Return which other program wrote a calibration, if its first lines show it."""
    try:
        first = read_text(path, CaptureError, SETTINGS_FILE)[:_MARKED]
    except CaptureError:
        return None
    return next((tool for mark, tool in _TOOLS.items() if mark in first), None)


def _calibrated(
    path: Path, source: str, names: Sequence[str], sizes_px: Sequence[Size] | None
) -> tuple[MountedCamera, ...]:
    """Return the cameras of a calibration, by name where names are equal, else in its order."""
    try:
        file, text = read_versioned(path, _CalibrationFile, "calibrations")
    except CaptureError as error:
        tool = _tool_of(path)
        if tool is None:
            raise
        raise CaptureError(
            f"{path} is a calibration by {tool}: write it as [[camera]] tables of TOML, with name, "
            "size_px, model, focal_px, center_px, distortion and rig_from_camera; howto/lenses.md "
            "has a table of the tools' names and orders, formats.md an example"
        ) from error
    lenses = mounted_lenses(path, file.camera, text)
    if len(lenses) != len(names):
        raise CaptureError(
            f"{path} is of {counted(len(lenses), 'camera')}, but {source} has "
            f"{len(names)}; give the calibration of those that took it"
        )
    pairs = list(zip(file.camera, lenses, strict=True))
    if {entry.name for entry in file.camera} == set(names):
        pairs.sort(key=lambda pair: names.index(pair[0].name))
    for (entry, mounted), size_px in zip(pairs, sizes_px or (), strict=False):
        if mounted.lens.size_px != tuple(size_px):
            raise CaptureError(
                f"{path}, camera '{entry.name}': size_px = {list(mounted.lens.size_px)}, but the "
                f"images of {source} have {size_px[0]}x{size_px[1]} pixels; give the calibration "
                "that was made for this size"
            )
    return tuple(
        MountedCamera(entry.name, mounted.lens, mounted.rig_from_camera) for entry, mounted in pairs
    )


def remedies(count: int) -> str:
    """Describe how to supply the calibration of `count` cameras that have none."""
    baseline = " with --baseline, the metres between two parallel cameras," if count == 2 else ""
    return (
        "give --fov, the angle of view from the left to the right border in degrees, such as "
        f"--fov 65,{baseline} or a calibration with --calibration FILE; if the camera moves around "
        "a static object, servoid scan estimates it"
    )


def _beside(right_m: float) -> Pose:
    return Pose.from_parts((right_m, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))

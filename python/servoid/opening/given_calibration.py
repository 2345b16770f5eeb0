"""Calibration that the user supplies: a calibration file, or an angle of view."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from servoid._native import Camera, Pose
from servoid.brief import brief
from servoid.camera import pinhole_lens
from servoid.config import NEAR_M, implausible
from servoid.errors import CaptureError, located
from servoid.exchange import calibration_files
from servoid.opening.calibration_file import Size, read_calibration
from servoid.source import MountedCamera
from servoid.words import digits

_RATE = "--rate"
_ANY_FOV_DEG, _ANY_BASELINE_M = 60.0, 1.0  # where only the images matter
_ANY_SIZE_PX = (640, 480)


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
    metres. `calibration` is a TOML file with [[camera]] tables, such as a rig.toml, or one by
    Kalibr, ROS or OpenCV; of two files the path is both names joined by a plus sign. `rate_hz` is
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

    @property
    def is_measured(self) -> bool:
        """Return whether the poses of the cameras on their rig are not made up from a baseline."""
        return self.baseline_m is None

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the files of the calibration; none if there is no calibration file."""
        return () if self.calibration is None else calibration_files(self.calibration)

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
            return Rig(*read_calibration(self.files, source, names, sizes_px))
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

"""Converts `sensor_msgs/CameraInfo` to lenses, for raw images and for rectified ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.camera import make_lens
from servoid.errors import CaptureError, located
from servoid.words import counted

CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

_BROWN = ("plumb_bob", "rational_polynomial")
_FISHEYE = ("equidistant", "fisheye")
_MODELS = (*_BROWN, *_FISHEYE)
_SAME_PX = 1e-3  # difference that numbers of one calibration may have between messages

LEAST_BASELINE_M = 1e-6
"""The least distance of two cameras that a calibration determines."""


@dataclass(frozen=True)
class Calibration:
    """A camera's lens, and what its calibration states about its pose.

    `frame_from_camera` rotates from the camera's image to the frame that its messages name:
    rectified images are rotated. `rectified_from_camera` rotates to the plane that a stereo pair
    shares; `shift_m`, (x, y) metres in that plane, is the camera's offset from the first of the
    pair. `rig_from_camera` is the pose that the user supplies, which takes precedence over TF.
    """

    lens: Lens
    frame_from_camera: Pose
    rectified_from_camera: Pose
    shift_m: tuple[float, float]
    rig_from_camera: Pose | None = None

    @classmethod
    def supplied(cls, camera: "SuppliedCamera") -> "Calibration":
        """Return the user's calibration of a camera for which the bag has none."""
        return cls(
            camera.lens, Pose.identity(), Pose.identity(), (0.0, 0.0), camera.rig_from_camera
        )

    def from_other(self, other: "Calibration") -> Pose | None:
        """Return the pose of the other camera of a pair in this one; None if there is no offset."""
        across, down = (to - at for at, to in zip(self.shift_m, other.shift_m, strict=True))
        if math.hypot(across, down) < LEAST_BASELINE_M:
            return None
        plane = Pose.from_parts((across, down, 0.0), (1.0, 0.0, 0.0, 0.0))
        return self.rectified_from_camera.inverse() @ plane @ other.rectified_from_camera


@dataclass(frozen=True)
class SuppliedCamera:
    """The user's calibration of a camera: its lens, and its pose; None: the pose from TF."""

    lens: Lens
    rig_from_camera: Pose | None


class BagCalibrationSupplier(Protocol):
    """Supplies the calibration of cameras for which the bag has none."""

    def __call__(
        self, names: Sequence[str], sizes_px: Sequence[tuple[int, int]], /, *, is_placed: bool
    ) -> Sequence[SuppliedCamera]:
        """Return the calibration of cameras with names and image sizes (width, height).

        With `is_placed`, TF has the pose of each of them.
        """
        ...


@dataclass(frozen=True)
class Info:
    """The content of a CameraInfo, with the same names in ROS 1 and ROS 2.

    Zeros in `r` and `p` state that the camera's rectification is unknown.
    """

    size_px: tuple[int, int]
    model: str
    d: tuple[float, ...]
    k: NDArray[np.float64]
    r: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 3)))
    p: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 4)))
    binning: tuple[int, int] = (1, 1)
    offset_px: tuple[int, int] = (0, 0)
    frame: str = ""

    @classmethod
    def of(cls, message: Any, frame: str) -> "Info":
        """Convert a decoded message."""
        d, k, r, p = (
            getattr(message, name if hasattr(message, name) else name.upper()) for name in "dkrp"
        )
        region = message.roi
        return cls(
            frame=frame,
            size_px=(int(message.width), int(message.height)),
            model=str(message.distortion_model),
            d=tuple(float(one) for one in d),
            k=np.asarray(k, np.float64).reshape(3, 3),
            r=np.asarray(r, np.float64).reshape(3, 3),
            p=np.asarray(p, np.float64).reshape(3, 4),
            binning=(max(1, int(message.binning_x)), max(1, int(message.binning_y))),
            offset_px=(int(region.x_offset), int(region.y_offset)),
        )

    @property
    def is_calibrated(self) -> bool:
        """Return whether there are focal lengths; drivers leave them zero until calibration."""
        return bool(self.k[0, 0] > 0.0 or self.p[0, 0] > 0.0)

    def is_like(self, other: "Info") -> bool:
        """Return whether two messages have the same calibration."""
        matrices = [(one.k, one.r, one.p, np.array(one.d)) for one in (self, other)]
        return self.model == other.model and all(
            a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=_SAME_PX)
            for a, b in zip(*matrices, strict=True)
        )


def calibration_of(
    info: Info, size_px: tuple[int, int], place: str, *, is_rectified: bool
) -> Calibration:
    """Return the calibration of a CameraInfo's camera for images of a size.

    Raw images use `K` and `D`, rectified ones `P` without distortion. If the image is a part of the
    sensor's, or is binned, focal lengths and principal point are adapted.

    Raises:
        CaptureError: the camera is not calibrated, the lens model is unknown, or the size differs.
        CameraError: the parameters describe no lens.

    """
    _check_size(info, size_px, place)
    turn = _turn(info.r, f"{place}, R")
    if is_rectified:
        matrix, distortion = _projection(info, place), ()
        model, frame_from_camera, to_plane = "pinhole", turn.inverse(), Pose.identity()
    else:
        matrix = _matrix(info, place)
        model, distortion = _distortion(info, place)
        frame_from_camera, to_plane = Pose.identity(), turn
    (fx, fy), (cx, cy) = np.diag(matrix)[:2], matrix[:2, 2]
    (across, down), (left, top) = info.binning, info.offset_px
    with located(place):
        lens = make_lens(
            place,
            model=model,
            size_px=size_px,
            focal_px=(float(fx) / across, float(fy) / down),
            # The centre of a binned pixel is the mean of the centres of its parts.
            center_px=(
                (float(cx) - left + 0.5) / across - 0.5 if across > 1 else float(cx) - left,
                (float(cy) - top + 0.5) / down - 0.5 if down > 1 else float(cy) - top,
            ),
            distortion=distortion,
        )
    return Calibration(lens, frame_from_camera, to_plane, _shift(info))


def _check_size(info: Info, size_px: tuple[int, int], place: str) -> None:
    most = info.size_px[0] // info.binning[0], info.size_px[1] // info.binning[1]
    is_part = info.offset_px != (0, 0)
    if size_px != most and not (is_part and size_px[0] <= most[0] and size_px[1] <= most[1]):
        raise CaptureError(
            f"{place} describes images of {most[0]}x{most[1]} pixels, but the recorded ones have "
            f"{size_px[0]}x{size_px[1]}; choose the images to which it belongs"
        )


def _matrix(info: Info, place: str) -> NDArray[np.float64]:
    if info.k[0, 0] <= 0.0:
        raise CaptureError(
            f"{place} has no focal length: the camera is not calibrated; calibrate it, or choose "
            "another camera"
        )
    return info.k


def _projection(info: Info, place: str) -> NDArray[np.float64]:
    if info.p[0, 0] > 0.0:
        return info.p[:, :3]
    if not any(info.d):
        return _matrix(info, place)
    raise CaptureError(
        f"{place} is not valid for rectified images: its P is zero; choose the raw images"
    )


def _distortion(info: Info, place: str) -> tuple[str, Sequence[float]]:
    """Return servoid's name of a lens model, and its coefficients."""
    if not any(info.d):
        return "pinhole", ()
    if info.model in _BROWN and len(info.d) >= 4:
        if any(info.d[8:]):
            raise CaptureError(
                f"{place}: D has {len(info.d)} coefficients; servoid supports the first 8 of "
                f"'{info.model}'; calibrate with those"
            )
        return "brown_conrady", info.d[:8] if len(info.d) >= 8 else info.d[:5]
    if info.model in _FISHEYE and len(info.d) == 4:
        return "kannala_brandt", info.d
    raise CaptureError(
        f"{place}: distortion_model is '{info.model}' with "
        f"{counted(len(info.d), 'coefficient')}; servoid supports {', '.join(_MODELS)}; "
        "rectify the images, or calibrate with one of these"
    )


def _turn(r: NDArray[np.float64], place: str) -> Pose:
    if not r.any():  # unknown
        return Pose.identity()
    matrix = np.eye(4)
    matrix[:3, :3] = r
    with located(place):
        return Pose(matrix)


def _shift(info: Info) -> tuple[float, float]:
    """Return the camera's offset from the first of its pair, which P has times focal length."""
    fx, fy = info.p[0, 0], info.p[1, 1]
    if fx <= 0.0 or fy <= 0.0:
        return 0.0, 0.0
    return float(-info.p[0, 3] / fx), float(-info.p[1, 3] / fy)

"""Chooses the streams of a RealSense camera, and reads the calibration of its eyes."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from servoid._native import Lens, Pose
from servoid.errors import CaptureError

_USUAL_HZ = 30
_USUAL_PX = (848, 480)  # the size for which the stereo module is optimised
_EYES = {1: "left", 2: "right"}  # infrared streams are numbered from 1
_STRAIGHT = 1e-6  # of a depth image's rotation and shift relative to the left eye


@dataclass(frozen=True, eq=False)
class Streams:
    """The sensor to open, its profiles, and the calibration of its eyes.

    `profiles` are those of the left and the right eye and of depth, None where there is none.
    """

    sensor: Any
    profiles: tuple[Any, Any, Any]
    lenses: tuple[Lens, Lens]
    rig_from_eyes: tuple[Pose, Pose]
    depth_unit_m: float
    notices: tuple[str, ...] = ()

    @property
    def rate_hz(self) -> int:
        """Return the images per second of each stream."""
        return self.profiles[0].fps()

    @property
    def depth(self) -> Any:
        """Return the profile of depth, or None."""
        return self.profiles[2]

    def name_of(self, frame: Any) -> str | None:
        """Return the stream to which an image belongs, None for one that was not requested."""
        came = _kind(frame.get_profile())
        for name, profile in zip(("left", "right", "depth"), self.profiles, strict=True):
            if profile is not None and _kind(profile) == came:
                return name
        return None


def choose_streams(library: Any, device: Any, rate_hz: float | None, depth: bool) -> Streams:
    """Choose the infrared pair of a device and, if requested, depth in the same pixels.

    Raises:
        CaptureError: it has no infrared pair, or none at this rate, or of another lens model.

    """
    for sensor in device.query_sensors():
        found: dict[tuple[int, int, int], dict[str, Any]] = {}
        for profile in sensor.get_stream_profiles():
            name = _name(library, profile)
            if name is not None:
                video = profile.as_video_stream_profile()
                key = video.width(), video.height(), video.fps()
                found.setdefault(key, {}).setdefault(name, video)
        pairs = {key: one for key, one in found.items() if {"left", "right"} <= set(one)}
        if pairs:
            chosen = pairs[_best(pairs, rate_hz)]
            return _described(library, sensor, chosen, depth)
    raise CaptureError("this RealSense camera has no infrared pair with 8 bits a pixel")


def _kind(profile: Any) -> tuple[Any, int]:
    return profile.stream_type(), profile.stream_index()


def _name(library: Any, profile: Any) -> str | None:
    """Return the name of a usable stream, or None."""
    kind, form = profile.stream_type(), profile.format()
    if kind == library.stream.infrared and form == library.format.y8:
        return _EYES.get(profile.stream_index())
    return "depth" if kind == library.stream.depth and form == library.format.z16 else None


def _best(keys: Iterable[tuple[int, int, int]], rate_hz: float | None) -> tuple[int, int, int]:
    """Return the best (width, height, images per second)."""
    wanted_hz = rate_hz or _USUAL_HZ
    rates = sorted({key[2] for key in keys})
    if rate_hz is not None and rate_hz not in rates:
        offered = ", ".join(map(str, rates))
        raise CaptureError(f"rate_hz = {rate_hz:g}, but this RealSense camera offers {offered}")
    nearest = min(rates, key=lambda rate: abs(rate - wanted_hz))
    fitting = [key for key in keys if key[2] == nearest]
    usual = [key for key in fitting if key[:2] == _USUAL_PX]
    return usual[0] if usual else max(fitting, key=lambda key: key[0] * key[1])


def _described(library: Any, sensor: Any, chosen: dict[str, Any], depth: bool) -> Streams:
    left, right = chosen["left"], chosen["right"]
    measured, notices = chosen.get("depth") if depth else None, ()
    if measured is not None and not _is_same_view(measured, left):
        measured = None
        notices = ("its depth is not in the pixels of the left eye, and is left out",)
    option = library.option.depth_units
    unit_m = sensor.get_option(option) if sensor.supports(option) else 0.001
    return Streams(
        sensor=sensor,
        profiles=(left, right, measured),
        lenses=(_lens(library, left), _lens(library, right)),
        rig_from_eyes=(Pose.identity(), _pose(left.get_extrinsics_to(right)).inverse()),
        depth_unit_m=unit_m,
        notices=notices,
    )


def _is_same_view(depth: Any, left: Any) -> bool:
    seen, other = depth.get_intrinsics(), left.get_intrinsics()
    apart = depth.get_extrinsics_to(left)
    turn = np.abs(np.reshape(apart.rotation, (3, 3)) - np.eye(3)).max()
    shift = np.abs(apart.translation).max()
    same = all(getattr(seen, one) == getattr(other, one) for one in ("fx", "fy", "ppx", "ppy"))
    return same and turn < _STRAIGHT and shift < _STRAIGHT


def _pose(extrinsics: Any) -> Pose:
    """Convert librealsense's extrinsics from a to b, with a column-major rotation, to b_from_a."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(extrinsics.rotation, (3, 3), order="F")
    matrix[:3, 3] = extrinsics.translation
    return Pose(matrix)


def _lens(library: Any, profile: Any) -> Lens:
    """Return the lens of an eye; a rectified one is a pinhole camera."""
    seen = profile.get_intrinsics()
    coefficients = [float(one) for one in seen.coeffs]
    bends = any(coefficients) and seen.model != library.distortion.none
    if bends and seen.model != library.distortion.brown_conrady:
        raise CaptureError(
            f"the distortion model {seen.model.name} of this RealSense camera is not supported; "
            "its infrared pair should be rectified"
        )
    return Lens(
        model="brown_conrady" if bends else "pinhole",
        size_px=(seen.width, seen.height),
        focal_px=(seen.fx, seen.fy),
        center_px=(seen.ppx, seen.ppy),
        distortion=coefficients if bends else (),
    )

"""The lens keys of `transforms.json`, for all images or for one."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import msgspec

from servoid.camera import Lens, make_lens
from servoid.errors import CaptureError

_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE")
_BROWN_CONRADY = ("OPENCV", "RADIAL", "SIMPLE_RADIAL")
_FISHEYES = ("OPENCV_FISHEYE",)

Angle = Annotated[float, msgspec.Meta(gt=0, lt=math.pi)]


class LensKeys(msgspec.Struct, frozen=True, kw_only=True):
    """Holds the keys that may be at the top of the file, or in the entry of an image."""

    camera_model: str | None = None
    is_fisheye: bool | None = None
    w: float | None = None
    h: float | None = None
    fl_x: float | None = None
    fl_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    camera_angle_x: Angle | None = None
    camera_angle_y: Angle | None = None
    k1: float | None = None
    k2: float | None = None
    k3: float | None = None
    k4: float | None = None
    k5: float | None = None
    k6: float | None = None
    p1: float | None = None
    p2: float | None = None


@dataclass(frozen=True)
class NerfLens:
    """The parameters of a lens; images with equal ones share a camera."""

    model: str
    size_px: tuple[int, int]
    focal_px: tuple[float, float]
    center_px: tuple[float, float]
    distortion: tuple[float, ...]

    def make(self, place: str) -> Lens:
        """Make the lens; CameraError if it is impossible."""
        return make_lens(
            place,
            model=self.model,
            size_px=self.size_px,
            focal_px=self.focal_px,
            center_px=self.center_px,
            distortion=self.distortion,
        )


def read_lens(
    shared: LensKeys, own: LensKeys, image_size: Callable[[], tuple[int, int]], place: str
) -> NerfLens:
    """Combine the keys for all images with those of one image.

    Raises:
        CaptureError: something is missing, or the lens model is not supported.

    """
    keys = _Keys(shared, own)
    width, height = _read_size(keys, image_size, place)
    focal_x, focal_y = keys.number("fl_x"), keys.number("fl_y")
    angle_x, angle_y = keys.number("camera_angle_x"), keys.number("camera_angle_y")
    if focal_x is None and angle_x is not None:
        focal_x = 0.5 * width / math.tan(0.5 * angle_x)
    if focal_y is None and angle_y is not None:
        focal_y = 0.5 * height / math.tan(0.5 * angle_y)
    if focal_x is None:
        raise CaptureError(
            f"{place}: the focal length is missing; write fl_x and fl_y in pixels, or "
            "camera_angle_x in radians"
        )
    center_x, center_y = keys.number("cx"), keys.number("cy")
    center_x = 0.5 * width if center_x is None else center_x
    center_y = 0.5 * height if center_y is None else center_y
    model, distortion = _read_distortion(keys, place)
    return NerfLens(
        model=model,
        size_px=(width, height),
        focal_px=(focal_x, focal_x if focal_y is None else focal_y),
        # Both programs cast rays through pixel + 0.5: their origin is the corner of the first
        # pixel, servoid's its centre.
        center_px=(center_x - 0.5, center_y - 0.5),
        distortion=distortion,
    )


class _Keys:
    """Looks up a key for one image: its own value if it has one, else that of all images."""

    def __init__(self, shared: LensKeys, own: LensKeys) -> None:
        self._shared, self._own = shared, own

    def model(self) -> str:
        named = self._own.camera_model or self._shared.camera_model
        if named is not None:
            return named
        fisheye = self._shared.is_fisheye if self._own.is_fisheye is None else self._own.is_fisheye
        return "OPENCV_FISHEYE" if fisheye else "OPENCV"

    def number(self, key: str) -> float | None:
        own = getattr(self._own, key)
        return getattr(self._shared, key) if own is None else own

    def coefficients(self, *names: str) -> tuple[float, ...]:
        return tuple(self.number(name) or 0.0 for name in names)


def _read_size(
    keys: _Keys, image_size: Callable[[], tuple[int, int]], place: str
) -> tuple[int, int]:
    width, height = keys.number("w"), keys.number("h")
    if width is None or height is None:
        return image_size()
    if not (width.is_integer() and height.is_integer()):
        raise CaptureError(f"{place}: w and h are {width} and {height}; write whole numbers")
    return int(width), int(height)


def _read_distortion(keys: _Keys, place: str) -> tuple[str, tuple[float, ...]]:
    """Return servoid's name of the lens model and its coefficients."""
    model = keys.model()
    if model in _FISHEYES:
        return "kannala_brandt", keys.coefficients("k1", "k2", "k3", "k4")
    if model not in (*_PINHOLES, *_BROWN_CONRADY):
        known = ", ".join((*_PINHOLES, *_BROWN_CONRADY, *_FISHEYES))
        raise CaptureError(
            f"{place}: the camera_model '{model}' is not supported; supported are {known}: "
            "undistort the images and write PINHOLE"
        )
    numbers = keys.coefficients("k1", "k2", "p1", "p2", "k3")
    if not any((*numbers, *keys.coefficients("k4", "k5", "k6"))):
        return "pinhole", ()
    if model in _PINHOLES:
        raise CaptureError(
            f"{place}: camera_model is {model}, which has no distortion, but k1 to p2 are not all "
            "zero; write OPENCV, or zeros"
        )
    if any(keys.coefficients("k4", "k5", "k6")):
        raise CaptureError(
            f"{place}: programs disagree about what k4, k5 and k6 mean with {model}; undistort the "
            "images and write zeros"
        )
    return "brown_conrady", numbers

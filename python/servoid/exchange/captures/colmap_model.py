"""Cameras and images of a COLMAP sparse model, independent of the file's form."""

from dataclasses import dataclass

from servoid.camera import Lens, make_lens
from servoid.errors import CaptureError


@dataclass(frozen=True)
class ColmapCamera:
    """A camera of a model: its lens model and parameters."""

    camera_id: int
    model: str
    size_px: tuple[int, int]
    parameters: tuple[float, ...]


@dataclass(frozen=True)
class ColmapImage:
    """An image of a model: `camera_from_world` as (w, x, y, z) and a translation."""

    image_id: int
    quaternion: tuple[float, ...]
    translation: tuple[float, ...]
    camera_id: int
    name: str


@dataclass(frozen=True)
class _Layout:
    """How a COLMAP lens model maps to one of servoid's: the positions of its parameters."""

    model: str
    parameters: int
    shares_focal: bool
    distortion: int  # coefficients, the rest being zero


# Names, order and meaning of the parameters: COLMAP's documentation of camera models. Their
# order is k1 k2 p1 p2 k3 k4 k5 k6 and k1 k2 k3 k4 as in OpenCV.
_LAYOUTS = {
    "SIMPLE_PINHOLE": _Layout("pinhole", 3, True, 0),
    "PINHOLE": _Layout("pinhole", 4, False, 0),
    "SIMPLE_RADIAL": _Layout("brown_conrady", 4, True, 4),
    "RADIAL": _Layout("brown_conrady", 5, True, 4),
    "OPENCV": _Layout("brown_conrady", 8, False, 4),
    "FULL_OPENCV": _Layout("brown_conrady", 12, False, 8),
    "OPENCV_FISHEYE": _Layout("kannala_brandt", 8, False, 4),
    "SIMPLE_RADIAL_FISHEYE": _Layout("kannala_brandt", 4, True, 4),
    "RADIAL_FISHEYE": _Layout("kannala_brandt", 5, True, 4),
    "SIMPLE_FISHEYE": _Layout("kannala_brandt", 3, True, 4),
    "FISHEYE": _Layout("kannala_brandt", 4, False, 4),
}

MODEL_NAMES = {
    0: "SIMPLE_PINHOLE",
    1: "PINHOLE",
    2: "SIMPLE_RADIAL",
    3: "RADIAL",
    4: "OPENCV",
    5: "OPENCV_FISHEYE",
    6: "FULL_OPENCV",
    7: "FOV",
    8: "SIMPLE_RADIAL_FISHEYE",
    9: "RADIAL_FISHEYE",
    10: "THIN_PRISM_FISHEYE",
    11: "RAD_TAN_THIN_PRISM_FISHEYE",
    12: "SIMPLE_DIVISION",
    13: "DIVISION",
    14: "SIMPLE_FISHEYE",
    15: "FISHEYE",
    16: "EUCM",
    17: "EQUIRECTANGULAR",
}


def parameter_count(model: str, place: str) -> int:
    """Return the number of parameters of a lens model.

    Raises:
        CaptureError: servoid does not support this model.

    """
    layout = _LAYOUTS.get(model)
    if layout is None:
        raise CaptureError(
            f"{place}: the camera model '{model}' is not supported; supported are "
            f"{', '.join(_LAYOUTS)}: undistort the images with COLMAP's image_undistorter"
        )
    return layout.parameters


def lens_of(camera: ColmapCamera, place: str) -> Lens:
    """Return the lens of a camera.

    Raises:
        CaptureError: the model is not supported, or has another number of parameters.
        CameraError: the parameters describe no lens.

    """
    needed = parameter_count(camera.model, place)
    if len(camera.parameters) != needed:
        raise CaptureError(
            f"{place}: {camera.model} has {needed} parameters, but {len(camera.parameters)} were "
            "given; export the model again"
        )
    layout = _LAYOUTS[camera.model]
    focals = 1 if layout.shares_focal else 2
    center = camera.parameters[focals : focals + 2]
    distortion = camera.parameters[focals + 2 :]
    return make_lens(
        place,
        model=layout.model,
        size_px=camera.size_px,
        focal_px=(camera.parameters[0], camera.parameters[focals - 1]),
        # COLMAP's origin is the corner of the first pixel, servoid's its centre.
        center_px=(center[0] - 0.5, center[1] - 0.5),
        distortion=(*distortion, *(0.0,) * (layout.distortion - len(distortion))),
    )

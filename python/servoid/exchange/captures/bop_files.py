"""Reads `scene_camera.json` and `scene_gt.json` of a BOP scene."""

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from servoid.errors import CaptureError, located
from servoid.exchange.captures.json_file import read_struct, read_table
from servoid.pose import Pose

_M_FROM_MM = 0.001

Three = tuple[float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]


class BopCamera(msgspec.Struct, frozen=True, kw_only=True):
    """One image's entry in a scene_camera.json; matrices are row-major, lengths in mm."""

    cam_K: Nine  # noqa: N815  the file's own name
    depth_scale: Annotated[float, msgspec.Meta(gt=0)] | None = None
    cam_R_w2c: Nine | None = None  # noqa: N815
    cam_t_w2c: Three | None = None

    @property
    def focal_px(self) -> tuple[float, float]:
        """Return the focal lengths in pixels."""
        return self.cam_K[0], self.cam_K[4]

    @property
    def center_px(self) -> tuple[float, float]:
        """Return the principal point in pixels."""
        return self.cam_K[2], self.cam_K[5]

    @property
    def depth_scale_m(self) -> float | None:
        """Return one unit of the depth image in metres, if the file states it."""
        return None if self.depth_scale is None else self.depth_scale * _M_FROM_MM

    @property
    def has_pose(self) -> bool:
        """Return whether the file has the camera's pose in the world."""
        return self.cam_R_w2c is not None and self.cam_t_w2c is not None

    def pose(self, place: str) -> Pose:
        """Return `camera_from_world`; PoseError if it is not a rigid motion."""
        if self.cam_R_w2c is None or self.cam_t_w2c is None:
            raise CaptureError(f"{place}: cam_R_w2c or cam_t_w2c is missing")
        return _pose(self.cam_R_w2c, self.cam_t_w2c, place)

    def without_pose(self) -> "BopCamera":
        """Return the camera's entry without its pose."""
        return BopCamera(cam_K=self.cam_K, depth_scale=self.depth_scale)


class BopPose(msgspec.Struct, frozen=True, kw_only=True):
    """The pose of one object in a scene_gt.json, in the camera's frame and in mm."""

    obj_id: int
    cam_R_m2c: Nine  # noqa: N815
    cam_t_m2c: Three

    def pose(self, place: str) -> Pose:
        """Return `camera_from_object`; PoseError if it is not a rigid motion."""
        return _pose(self.cam_R_m2c, self.cam_t_m2c, place)


def read_scene_camera(path: Path) -> dict[int, BopCamera]:
    """Read a scene_camera.json: the entry of each image.

    Raises:
        CaptureError: the file is missing or malformed, or a camera is not a pinhole without skew.

    """
    cameras = {}
    for key, value in read_table(path).items():
        place = f"{path}, image {key}"
        camera = read_struct(value, BopCamera, place)
        skew, zero, *last = (camera.cam_K[index] for index in (1, 3, 6, 7, 8))
        if (skew, zero, last) != (0.0, 0.0, [0.0, 0.0, 1.0]):
            raise CaptureError(
                f"{place}: cam_K is {list(camera.cam_K)}; it must be fx 0 cx, 0 fy cy, 0 0 1"
            )
        cameras[_image_number(key, path)] = camera
    return cameras


def read_scene_gt(path: Path) -> dict[int, tuple[BopPose, ...]]:
    """Read a scene_gt.json: the objects in each image.

    Raises:
        CaptureError: the file is missing or malformed.

    """
    truth = {}
    for key, value in read_table(path).items():
        if not isinstance(value, list):
            raise CaptureError(f"{path}, image {key}: expected a list of objects")
        truth[_image_number(key, path)] = tuple(
            read_struct(one, BopPose, f"{path}, image {key}[{index}]")
            for index, one in enumerate(value)
        )
    return truth


def _image_number(key: str, path: Path) -> int:
    if not (key.isascii() and key.isdigit() and len(key) <= 9):
        raise CaptureError(f"{path}: '{key[:40]}' is not an image number, such as '12'")
    return int(key)


def _pose(rotation: Nine, translation_mm: Three, place: str) -> Pose:
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(rotation, (3, 3))
    matrix[:3, 3] = np.array(translation_mm) * _M_FROM_MM
    with located(place):
        return Pose(matrix)

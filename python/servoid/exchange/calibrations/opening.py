"""Identifies a calibration by another program, and reads it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from servoid.config import CALIBRATION_FILE, beside, is_file, is_folder, read_text, read_yaml
from servoid.errors import CaptureError
from servoid.exchange.calibrations.kalibr import is_kalibr, read_kalibr
from servoid.exchange.calibrations.opencv import is_opencv, read_opencv
from servoid.exchange.calibrations.ros import is_ros, read_ros
from servoid.exchange.calibrations.tables import Size, ToolCalibration
from servoid.words import joined

_JOINED = "+"
_PAIR = (("left.yaml", "right.yaml"), ("left.yml", "right.yml"))
_OWN_SUFFIX, _YAML_SUFFIXES = ".toml", (".yaml", ".yml")
_MARKED = 4096  # first characters of a calibration, which show whose it is
_READ = (
    "T_cn_cnm1",
    "distortion_coeffs",
    "opencv-matrix",
    "distortion_model",
    "camera_matrix",
)
_OTHERS = {
    "Camera list with one line of data per camera": "COLMAP",
    "<document": "Metashape",
    "camera_angle_x": "nerfstudio",
}
_XML = "<opencv_storage"


def calibration_files(path: Path) -> tuple[Path, ...]:
    """Return the files that a path names: one, two joined by a plus sign, or those of a pair.

    A folder stands for the left.yaml and right.yaml in it.
    """
    if is_folder(path):
        pairs = [tuple(path / name for name in names) for names in _PAIR]
        return next((pair for pair in pairs if all(map(is_file, pair))), (path,))
    parts = str(path).split(_JOINED)
    if is_file(path) or len(parts) == 1 or not all(parts):
        return (path,)
    return tuple(map(Path, parts))


def read_tool_calibration(
    paths: Sequence[Path], sizes_px: Sequence[Size] | None
) -> ToolCalibration | None:
    """Read the calibration in one file, or in the two of a pair; None if it is no other program's.

    `sizes_px` are the sizes (width, height) of the images for which it is given, where known.

    Raises:
        CaptureError: a file is damaged, or is of a program whose calibrations servoid does not
            read; or the calibration is incomplete.
        CameraError: the parameters describe no lens.
        PoseError: the pose of a camera is not a rigid motion.

    """
    if len(paths) > 1 and any(map(_is_own, paths)):
        raise CaptureError(
            f"{joined(list(map(str, paths)))} are several files; write their [[camera]] tables "
            "into one TOML file"
        )
    if len(paths) == 1 and is_folder(paths[0]):
        there = beside(paths[0] / "left.yaml", (_OWN_SUFFIX, *CALIBRATION_FILE.suffixes))
        raise CaptureError(
            f"{paths[0]} is a folder without both left.yaml and right.yaml; give a file: {there}"
        )
    if len(paths) == 1 and not _is_tools(paths[0]):
        return None
    contents = [_table(path) for path in paths]
    if all(map(is_kalibr, contents)):
        if len(paths) > 1:
            raise CaptureError(
                f"{joined(list(map(str, paths)))} are {len(paths)} chains of Kalibr; give the "
                "camchain.yaml of a calibration of all cameras together"
            )
        return read_kalibr(paths[0], contents[0])
    if all(map(is_ros, contents)):
        return read_ros(paths, contents)
    if all(is_opencv(content) and not is_ros(content) for content in contents):
        return read_opencv(paths, contents, sizes_px)
    raise CaptureError(
        f"{joined(list(map(str, paths)))} {'is' if len(paths) == 1 else 'are'} not a calibration "
        "that servoid knows; give a rig.toml, a camchain.yaml of Kalibr, the left.yaml+right.yaml "
        "of ROS, or a file with M1, D1, M2, D2, R and T of OpenCV"
    )


def _is_tools(path: Path) -> bool:
    """Return whether a file is by another program; CaptureError for one that servoid cannot read.

    Whether it can be read at all is left to its reader.
    """
    if _is_own(path):
        return False
    if path.suffix.lower() in _YAML_SUFFIXES:
        return True
    try:
        first = read_text(path, CaptureError, CALIBRATION_FILE)[:_MARKED]
    except CaptureError:
        return False
    if _XML in first:
        raise CaptureError(
            f"{path} is a calibration by OpenCV in XML, which servoid does not read; write it as "
            "YAML, as cv2.FileStorage does if the name of the file ends in .yml"
        )
    for mark, tool in _OTHERS.items():
        if mark in first:
            raise CaptureError(
                f"{path} is a calibration by {tool}: write it as [[camera]] tables of TOML, with "
                "name, size_px, model, focal_px, center_px, distortion and rig_from_camera; "
                "howto/lenses.md has a table of the tools' names and orders, formats.md an example"
            )
    return any(mark in first for mark in _READ)


def _is_own(path: Path) -> bool:
    return path.suffix.lower() == _OWN_SUFFIX


def _table(path: Path) -> dict[str, Any]:
    content = read_yaml(path, CaptureError, CALIBRATION_FILE)
    if not isinstance(content, dict):
        raise CaptureError(
            f"{path}: expected a table of keys and values; give {CALIBRATION_FILE.wanted}"
        )
    return content

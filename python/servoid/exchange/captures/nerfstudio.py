"""Opens `transforms.json`, the format of nerfstudio and instant-ngp, as a capture."""

from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Annotated

import msgspec
import numpy as np

from servoid.camera import Picture, read_image_size
from servoid.capture import Capture
from servoid.config import check_held, check_inside, first_file, is_folder
from servoid.errors import CaptureError, located
from servoid.exchange.captures.gathering import Shot, ShotCamera, gather, group, number, short_names
from servoid.exchange.captures.json_file import read_struct, read_table
from servoid.exchange.captures.nerfstudio_lens import LensKeys, NerfLens, read_lens
from servoid.pose import Pose

FILE_NAME = "transforms.json"

# For image names without a suffix, as nerfstudio, instant-ngp and Blender scenes have them.
_SUFFIXES = ("", ".png", ".jpg", ".jpeg", ".JPG", ".PNG")
# nerfstudio's own default: depth images are in millimetres.
_DEPTH_SCALE_M = 0.001
# Its cameras look along -z with y up; servoid's along z with y down.
_GL_FROM_LENS = np.diag([1.0, -1.0, -1.0, 1.0])

Row = tuple[float, float, float, float]


class FrameEntry(LensKeys, frozen=True, kw_only=True):
    """Holds one entry of `frames`: an image and its pose."""

    file_path: str
    transform_matrix: tuple[Row, Row, Row, Row]
    mask_path: str | None = None
    depth_file_path: str | None = None


class TransformsFile(LensKeys, frozen=True, kw_only=True):
    """Holds a whole transforms.json; its lens keys apply to images that have none of their own."""

    frames: tuple[FrameEntry, ...]
    depth_unit_scale_factor: Annotated[float, msgspec.Meta(gt=0)] = _DEPTH_SCALE_M


def open_nerfstudio(path: str | Path) -> Capture:
    """Open a transforms.json, or the folder that contains one, as a capture.

    Images with the same lens become one camera; each is an observation of its own, in the order of
    the file. Lengths are in the file's unit, which is unknown.

    Raises:
        CaptureError: a file is missing or malformed, or a lens model is not supported.
        CameraError: a camera cannot exist.
        ImageError: neither the file nor the image states the image's size.
        PoseError: a `transform_matrix` is not a rigid motion.

    """
    path = Path(path)
    path = path / FILE_NAME if is_folder(path) else path
    table = read_table(path)
    if "ellipsoids" in table and "frames" not in table:
        raise CaptureError(
            f"{path} is a body, not a capture; name the folder of the images, and the body with "
            f"--body {path} to track it there"
        )
    file = read_struct(table, TransformsFile, str(path))
    labels = short_names([frame.file_path for frame in file.frames])
    shots = group([_read_frame(path, file, index, label) for index, label in enumerate(labels)])
    return gather(
        path,
        [
            ShotCamera(
                number(index, len(shots)),
                lens.make(str(path)),
                taken,
                depth_scale_m=file.depth_unit_scale_factor,
            )
            for index, (lens, taken) in enumerate(shots.items())
        ],
        metric=False,
    )


def _read_frame(path: Path, file: TransformsFile, index: int, label: str) -> tuple[NerfLens, Shot]:
    frame = file.frames[index]
    place = f"{path}, frames[{index}]"
    image = _find(path, frame.file_path, f"{place}.file_path", _SUFFIXES)
    with located(f"{place}.transform_matrix"):
        world_from_lens = Pose(np.array(frame.transform_matrix) @ _GL_FROM_LENS)
    lens = read_lens(file, frame, lambda: read_image_size(image), place)
    return lens, Shot(
        picture=Picture(image, label=label),
        world_from_lens=world_from_lens,
        mask_path=_find_optional(path, frame.mask_path, f"{place}.mask_path"),
        depth_path=_find_optional(path, frame.depth_file_path, f"{place}.depth_file_path"),
    )


def _find_optional(path: Path, name: str | None, place: str) -> Path | None:
    return None if name is None else _find(path, name, place)


def _find(path: Path, name: str, place: str, suffixes: Sequence[str] = ("",)) -> Path:
    """Return the file to which a name refers."""
    check_inside(name, place)
    start = PurePosixPath(name)
    found = first_file(path.parent / start.with_name(start.name + suffix) for suffix in suffixes)
    if found is None:
        raise CaptureError(f"{place}: there is no {path.parent / name}; correct the path")
    check_held([found], path.parent, place)
    return found

"""Reads depth images: metres along z for each pixel, NaN where nothing was measured."""

import io
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from servoid.camera.images import check_size, decode
from servoid.config import IMAGE_FILE, read_bytes
from servoid.errors import ImageError

_KINDS = "16-bit PNG, 16-bit or float32 TIFF, or .npy"


class StoredDepth(Protocol):
    """One depth image that is not a file of its own and that knows its unit."""

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.float32]:
        """Read the depth image of (width, height) pixels as `read_depth` does."""
        ...


def read_depth(
    path: Path, size_px: tuple[int, int], scale_m: float, by: int = 1
) -> NDArray[np.float32]:
    """Read a depth image of (width, height) pixels whose unit is `scale_m` metres.

    Returns (H, W) float32, metres along z; NaN where the file has zero, a negative number, NaN,
    infinity, or the greatest number of its type of integers, such as 65535, by which cameras tell
    that something is too near, too far or not measured. If the image is shrunk (`by` greater than
    1), each pixel takes one value of the file: the mean of several depths would lie where there is
    no surface.

    Raises:
        ImageError: the file is missing, cut short, of another size, or not a depth image.

    """
    values = _read_npy(path, size_px) if path.suffix == ".npy" else _read_image(path, size_px)
    return to_metres(values, scale_m, by)


def to_metres(values: NDArray[np.generic], scale_m: float, by: int = 1) -> NDArray[np.float32]:
    """Convert the values of a depth image, (H, W), to metres as `read_depth` does."""
    if by > 1:
        rows, columns = values.shape[0] // by, values.shape[1] // by
        values = values[by // 2 :: by, by // 2 :: by][:rows, :columns]
    with np.errstate(over="ignore", invalid="ignore"):
        depth = (values.astype(np.float64) * scale_m).astype(np.float32)
    measured = np.isfinite(depth) & (depth > 0.0)
    if values.dtype.kind in "iu":
        measured &= values != np.iinfo(str(values.dtype)).max
    depth[~measured] = np.nan
    return depth


def _read_image(path: Path, size_px: tuple[int, int]) -> NDArray[np.generic]:
    import cv2

    pixels = decode(path, cv2.IMREAD_UNCHANGED, size_px, ImageError)
    if pixels.ndim != 2:
        raise ImageError(
            f"{path} has {pixels.shape[2]} channels; a depth image has one: save it as {_KINDS}"
        )
    if pixels.dtype == np.uint8:
        raise ImageError(
            f"{path} has 8 bits a pixel, too few for depth; save it as {_KINDS}, without rescaling"
        )
    return pixels


def _read_npy(path: Path, size_px: tuple[int, int]) -> NDArray[np.generic]:
    data = read_bytes(path, ImageError, IMAGE_FILE)
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = (
            np.lib.format.read_array_header_1_0
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0
        )
        shape, in_columns, kind = read_header(stream)
    except Exception as reason:
        # NumPy evaluates the header as a Python expression, so it may raise any exception.
        raise ImageError(f"{path} is no .npy file, or its header is damaged") from reason
    if len(shape) == 3 and shape[2] == 1:
        shape = shape[:2]
    if len(shape) != 2 or kind.kind not in "fui":
        raise ImageError(
            f"{path} has shape {shape} of {kind}; a depth image is (height, width) of numbers"
        )
    check_size(path, (shape[1], shape[0]), size_px, ImageError)
    content = data[stream.tell() :]
    if len(content) < shape[0] * shape[1] * kind.itemsize:
        raise ImageError(f"{path} is cut short: its end is missing; copy the file again")
    values = np.frombuffer(content, kind, count=shape[0] * shape[1])
    return values.reshape(shape, order="F" if in_columns else "C")

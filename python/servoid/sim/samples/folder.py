"""Writes a sample's folder completely or not at all, and replaces nothing but a sample."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid import output
from servoid.errors import OutputError

MARK = "# servoid's own sample"  # first line of the capture.toml of every sample

_SAMPLE = output.FolderKind(
    "a sample",
    MARK,
    frozenset({"capture.toml", "poses.csv", "images", "masks", "left", "right", "truth"}),
)
_JPEG_QUALITY = 92


def write_folder(directory: Path, fill: Callable[[Path], None]) -> None:
    """Let `fill` write into a new folder, then replace `directory` by it.

    Raises:
        OutputError: `directory` contains other files than a sample or cannot be written; it stays
            unchanged.

    """
    output.write_folder(directory, fill, _SAMPLE)


def encode(kind: str, pixels: NDArray[np.uint8], quality: int = _JPEG_QUALITY) -> bytes:
    """Return a grey or RGB image as the bytes of a .jpg or .png file.

    Raises:
        OutputError: the image cannot be encoded.

    """
    import cv2  # slow to import, and help texts do not need it

    options = [cv2.IMWRITE_JPEG_QUALITY, quality] if kind == ".jpg" else []
    stored = pixels[:, :, ::-1] if pixels.ndim == 3 else pixels
    done, data = cv2.imencode(kind, np.ascontiguousarray(stored), options)
    if not done:
        raise OutputError(f"cannot encode a {kind} image of shape {pixels.shape}")
    return data.tobytes()

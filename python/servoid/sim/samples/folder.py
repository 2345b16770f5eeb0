"""Writes a sample's folder whole or not at all, and never over anything but a sample."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.errors import OutputError

MARK = "# servoid's own sample"  # how the capture.toml of every sample begins

_NAMES = {"capture.toml", "poses.csv", "images", "masks", "left", "right", "truth"}
_JPEG_QUALITY = 92


def write_folder(directory: Path, fill: Callable[[Path], None]) -> None:
    """Let `fill` write into a new folder, then put it in the place of `directory`.

    Raises:
        OutputError: `directory` holds something else than a sample or cannot be written; it stays
            as it was.

    """
    _check_replaceable(directory)
    target = directory.resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".servoid-", dir=target.parent) as scratch:
            draft = Path(scratch) / "sample"
            draft.mkdir()
            fill(draft)
            _check_replaceable(directory)  # again: the images took a while
            if target.exists():
                target.rename(Path(scratch) / "earlier")
            draft.rename(target)
    except OSError as error:
        raise OutputError(
            f"cannot write a sample into {directory}: {(error.strerror or str(error)).lower()}"
        ) from error


def encode(kind: str, pixels: NDArray[np.uint8], quality: int = _JPEG_QUALITY) -> bytes:
    """Return a grey or RGB image as the bytes of a .jpg or .png file.

    Raises:
        OutputError: no such image can be made.

    """
    import cv2  # slow to import, and help texts do not need it

    options = [cv2.IMWRITE_JPEG_QUALITY, quality] if kind == ".jpg" else []
    stored = pixels[:, :, ::-1] if pixels.ndim == 3 else pixels
    done, data = cv2.imencode(kind, np.ascontiguousarray(stored), options)
    if not done:
        raise OutputError(f"cannot encode a {kind} image of shape {pixels.shape}")
    return data.tobytes()


def _check_replaceable(directory: Path) -> None:
    """Refuse a place where a sample would overwrite anything but an earlier sample."""
    if not directory.exists():
        return
    if not directory.is_dir():
        raise OutputError(f"cannot write a sample into {directory}: it is a file; name a folder")
    names = {path.name for path in directory.iterdir()}
    if names and not (_is_sample(directory) and names <= _NAMES):
        raise OutputError(
            f"cannot write a sample into {directory}: the folder holds other files; name a folder "
            "that is empty or does not exist yet"
        )


def _is_sample(directory: Path) -> bool:
    capture = directory / "capture.toml"
    return capture.is_file() and capture.read_bytes().startswith(MARK.encode())

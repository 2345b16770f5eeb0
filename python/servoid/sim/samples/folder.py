"""Writes a sample's folder completely or not at all, and replaces nothing but a sample."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid import output
from servoid.errors import OutputError

MARK = "# servoid's own sample"  # first line of the capture.toml of every sample

POSES = "poses.csv"
TRUTH, TRUE_POSES, TRUE_MESH = "truth", "left_from_object.csv", "mesh.obj"
_JPEG_QUALITY = 92


def write_folder(directory: Path, fill: Callable[[Path], None]) -> None:
    """Let `fill` write into a new folder, then replace `directory` by it.

    Raises:
        OutputError: `directory` contains other files than a sample or cannot be written; it stays
            unchanged.

    """
    output.write_folder(directory, fill, output.FolderKind("a sample", MARK, _own))


def still_name(index: int) -> str:
    """Return the name of the files of one view, without their endings."""
    return f"{index:04d}"


def moving_name(index: int) -> str:
    """Return the name of the files of one observation, without their endings."""
    return f"{index:06d}"


def _own(directory: Path) -> set[str]:
    """Return the paths that writing the sample in a folder left there.

    Their number is that of its poses, so that an image that somebody added is not among them.
    """
    own = {"capture.toml", "masks"}
    if f'"{POSES}"' in (directory / "capture.toml").read_text(encoding="utf-8"):
        own.add(POSES)
    true_poses = directory / TRUTH / TRUE_POSES
    if true_poses.is_file():
        names = [moving_name(index) for index in range(_lines(true_poses) - 1)]
        own |= {TRUTH, f"{TRUTH}/{TRUE_POSES}", f"{TRUTH}/{TRUE_MESH}", "left", "right"}
        own |= {f"{camera}/{name}.jpg" for camera in ("left", "right") for name in names}
        return own | {f"masks/{moving_name(0)}.png"}
    names = [still_name(index) for index in range(_lines(directory / POSES) - 1)]
    images = {f"images/{name}.jpg" for name in names}
    return own | images | {f"masks/{name}.png" for name in names} | {"images"}


def _lines(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.is_file() else 0


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

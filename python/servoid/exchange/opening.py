"""Identifies a capture by the files in its folder, whatever program wrote it, and opens it."""

from collections.abc import Sequence
from pathlib import Path

from servoid.capture import Capture, examined, open_capture
from servoid.config import is_file, is_folder
from servoid.errors import CaptureError
from servoid.exchange.bags import is_bag, open_bag
from servoid.exchange.captures import bop, nerfstudio
from servoid.exchange.captures.bop import open_bop
from servoid.exchange.captures.colmap import find_colmap_model, open_colmap
from servoid.exchange.captures.gathering import in_metres
from servoid.exchange.captures.nerfstudio import open_nerfstudio

_COLMAP_FILES = ("cameras.bin", "cameras.txt", "images.bin", "images.txt")


def open_any(
    path: str | Path,
    *,
    bop_object: int | None = None,
    images: str | Path | None = None,
    topics: Sequence[str] = (),
    world: str | None = None,
    unit_m: float | None = None,
) -> Capture:
    """Open a capture, a COLMAP model, a transforms.json, a BOP scene or a bag.

    `path` is the folder, or the main file in it. `bop_object` selects the object of a BOP scene by
    its index; `images` is the folder of a COLMAP model's images; `topics` and `world` are those of
    `open_bag`. `unit_m` is the length in metres of one unit of a COLMAP model or a transforms.json,
    1 if it is in metres; without, such a capture is not metric.

    Raises:
        CaptureError: servoid can open nothing there, a file is malformed, or an argument
            belongs to another kind of capture.
        CameraError, ImageError, PoseError: as for the reader that opens it.

    """
    path = Path(path)
    kind = _kind(path)
    if images is not None and kind != "colmap":
        raise CaptureError(f"{path} is not a COLMAP model, and only those take a folder of images")
    if bop_object is not None and kind != "bop":
        raise CaptureError(f"{path} is not a BOP scene, and only those take an object")
    if (topics or world is not None) and kind != "bag":
        raise CaptureError(f"{path} is not a bag, and only those take topics and frames")
    if unit_m is not None and kind not in ("colmap", "nerfstudio"):
        raise CaptureError(
            f"{path} is neither a COLMAP model nor a transforms.json, and only their lengths are "
            "in a unit that can be given"
        )
    folder = path if is_folder(path) else path.parent
    if kind == "bag":
        return open_bag(path, topics, world=world)
    if kind == "capture":
        return open_capture(path)
    if kind == "bop":
        return examined(open_bop(folder, bop_object))
    opened = open_colmap(folder, images) if kind == "colmap" else open_nerfstudio(path)
    return examined(opened if unit_m is None else in_metres(opened, unit_m))


def is_capture(path: Path) -> bool:
    """Return whether `open_any` recognises what is in a folder, without reading it."""
    try:
        _kind(path)
    except CaptureError:
        return False
    return True


def holds_capture_file(path: Path) -> bool:
    """Return whether the path holds servoid's own format: a capture.toml."""
    return is_capture(path) and _kind(path) == "capture"


def holds_bag(path: Path) -> bool:
    """Return whether the path is a bag, or a folder with one."""
    return is_capture(path) and _kind(path) == "bag"


def _kind(path: Path) -> str:
    if is_file(path):
        if path.name in _COLMAP_FILES:
            return "colmap"
        if path.name == bop.FILE_NAME:
            return "bop"
        if is_bag(path):
            return "bag"
        if path.suffix not in (".json", ".toml"):
            raise CaptureError(
                f"{path} is not a capture; name a folder with a capture.toml, which gives the "
                'camera of a video or images, such as images = "film.mp4"'
            )
        return "nerfstudio" if path.suffix == ".json" else "capture"
    # Captures first: a capture.toml beside other files takes precedence.
    if is_file(path / "capture.toml"):
        return "capture"
    if is_file(path / nerfstudio.FILE_NAME):
        return "nerfstudio"
    if is_folder(path) and find_colmap_model(path) is not None:
        return "colmap"
    if is_file(path / bop.FILE_NAME):
        return "bop"
    if is_bag(path):
        return "bag"
    if not is_folder(path):
        raise CaptureError(
            f"there is no {path}; name a folder with a capture.toml, or another kind of capture"
        )
    raise CaptureError(
        f"there is no capture in {path}: no capture.toml, no {nerfstudio.FILE_NAME}, no "
        "cameras.bin or cameras.txt of COLMAP in it, in sparse or in sparse/0, no "
        f"{bop.FILE_NAME}, no bag; name a folder that holds one of these"
    )

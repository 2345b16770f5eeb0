"""Refuses files and folders that hold nothing that servoid opens, with what it does open."""

from pathlib import Path

from servoid.camera import IMAGE_SUFFIXES, VIDEO_SUFFIXES
from servoid.config import is_folder
from servoid.errors import CaptureError
from servoid.exchange import bop, is_capture, nerfstudio
from servoid.exchange.shapes import SUFFIXES as MESH_SUFFIXES
from servoid.opening.word import BAG_SUFFIXES, Kind, SourceWord
from servoid.words import joined


def check_openable(word: SourceWord) -> None:
    """Check that a file or a folder holds something that servoid opens, by the names alone.

    Raises:
        CaptureError: it does not.

    """
    if word.kind is not Kind.CAPTURE or is_capture(word.place):
        return
    if is_folder(word.place):
        raise CaptureError(_why_not_folder(word.place))
    if word.place.suffix.lower() in MESH_SUFFIXES:
        raise CaptureError(
            f"{word} is a mesh or a point cloud, and images are needed; only servoid model takes "
            f"it: servoid model {word} --out {word.place.stem}.json"
        )
    raise CaptureError(
        f"servoid cannot open {word}, by the ending of its name: videos end in "
        f"{joined(VIDEO_SUFFIXES, 'or')}, images in {joined(IMAGE_SUFFIXES, 'or')}, bags in "
        f"{joined(BAG_SUFFIXES, 'or')}, captures in .toml or .json, meshes in "
        f"{joined(MESH_SUFFIXES, 'or')}; convert it to one of these, or correct its name"
    )


def _why_not_folder(folder: Path) -> str:
    inside = sorted(folder.iterdir())
    films = [one for one in inside if one.suffix.lower() in VIDEO_SUFFIXES]
    captures = [one for one in inside if one.is_dir() and is_capture(one)]
    remedy = "name a folder that holds one of these, or a video"
    for what, found in (("a video", films), ("a capture", captures)):
        if found:
            remedy = f"but there is {what} in it; name that, {found[0]}"
            break
    return (
        f"there is no capture in {folder}: no images ({', '.join(IMAGE_SUFFIXES)}), no "
        f"capture.toml, no {nerfstudio.FILE_NAME}, no cameras.bin or cameras.txt of COLMAP in it, "
        f"in sparse or in sparse/0, no {bop.FILE_NAME}, no bag; {remedy}"
    )

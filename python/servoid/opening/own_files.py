"""Tells which files belong to a SOURCE, so that no command writes over what it reads."""

from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path, PurePath
from typing import Any

from servoid.config import followed, is_folder, is_same, read_toml_text
from servoid.errors import CaptureError
from servoid.exchange import holds_capture_file, is_capture
from servoid.opening.word import BAG_FOLDER, BAG_SUFFIXES, Kind, SourceWord

_OWN_TABLES = ("capture.toml", "poses.csv", "images.csv")
_OWN_PATTERNS = ("images", "masks", "depths")
_WILD = "*?["

# Of COLMAP models, transforms.json and BOP scenes; their tables may be in a folder of the folder.
_TABLES = frozenset(
    f"{name}.{ending}"
    for name in ("cameras", "images", "points3D", "frames", "rigs")
    for ending in ("bin", "txt")
) | {"transforms.json", "scene_camera.json", "scene_gt.json", "scene_gt_info.json"}
_IMAGE_FOLDERS = ("images", "masks", "rgb", "gray", "depth", "mask", "mask_visib")


def belongs_to_source(path: Path, word: SourceWord) -> bool:
    """Return whether writing to `path` would change what a source consists of.

    These are its files, and of a folder the tables that describe it and all in its image folders,
    whether they exist or not. Other files in the folder of a capture are the user's.
    """
    if any(is_same(path, place) for place in word.places):
        return True
    if word.kind not in (Kind.CAPTURE, Kind.BAG):
        return False
    place = word.place
    folder = followed(place if is_folder(place) else place.parent)
    target = followed(path)
    if not target.is_relative_to(folder):
        return False
    inside = target.relative_to(folder)
    if word.kind is Kind.BAG:
        is_part = inside.name == BAG_FOLDER or inside.suffix in BAG_SUFFIXES
        return is_folder(place) and is_part and target.exists()
    if not is_capture(place):  # a mesh, for instance
        return False
    if holds_capture_file(place):
        return _is_of_capture(inside, place / "capture.toml" if is_folder(place) else place)
    return inside.name in _TABLES or any(_is_in(inside, PurePath(name)) for name in _IMAGE_FOLDERS)


def _is_of_capture(inside: PurePath, toml: Path) -> bool:
    """Return whether a path relative to the folder of a capture.toml is one that it names."""
    if str(inside) in _OWN_TABLES:
        return True
    return any(_is_named(inside, name) for name in _named(toml))


def _named(toml: Path) -> Iterator[str]:
    """Yield the paths and patterns in a capture.toml; errors in it are left to its reader."""
    try:
        data, _ = read_toml_text(toml, CaptureError)
    except CaptureError:
        return
    cameras, rig = data.get("camera"), data.get("rig")
    tables: list[Any] = [*(cameras if isinstance(cameras, list) else ()), rig]
    for table in tables:
        if isinstance(table, dict):
            names = [table.get(key) for key in (*_OWN_PATTERNS, "poses")]
            yield from (name for name in names if isinstance(name, str) and name)


def _is_named(inside: PurePath, pattern: str) -> bool:
    folder = PurePath(pattern).parent
    if folder.parts and not any(sign in str(folder) for sign in _WILD):
        return _is_in(inside, folder)
    return fnmatch(inside.as_posix(), PurePath(pattern).as_posix())


def _is_in(inside: PurePath, folder: PurePath) -> bool:
    return folder in (inside, *inside.parents)

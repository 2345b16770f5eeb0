"""The images that a scan uses: a film or photographs, upright, each with a name."""

import glob
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.brief import brief
from servoid.camera import VIDEO_SUFFIXES, Picture, count_video_images, read_upright, upright_images
from servoid.errors import ScanError

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp")
_BLANK = re.compile(r"\s")
_FOLDER = "images"  # where many programs keep the images of a project


@dataclass(frozen=True)
class Film:
    """The images of a video; image 12 has the name `0012`, counted from 0."""

    path: Path

    @property
    def is_film(self) -> bool:
        """Return True: neighbours show nearly the same."""
        return True

    @cached_property
    def names(self) -> Sequence[str]:
        """Return the names of the images, which are their numbers."""
        count = count_video_images(self.path)
        digits = max(4, len(str(count - 1)))  # so that sorting the names sorts the images
        return tuple(f"{index:0{digits}}" for index in range(count))

    def images(self, names: Iterable[str]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
        """Decode the video once, and yield the requested images."""
        wanted = set(names)
        for name, image in zip(self.names, upright_images(self.path), strict=False):
            if name in wanted:
                yield name, image

    def file_of(self, name: str) -> Path | None:  # noqa: ARG002
        """Return None: no file contains a single image."""
        return None


@dataclass(frozen=True)
class Photographs:
    """Photographs, one per file, sorted by name as in a capture."""

    path: Path
    files: tuple[Path, ...]

    __repr__ = brief

    @property
    def is_film(self) -> bool:
        """Return False: photographs are independent of each other."""
        return False

    @property
    def names(self) -> Sequence[str]:
        """Return the file names without their endings, with _ for each blank."""
        return tuple(image_name(file.stem) for file in self.files)

    def images(self, names: Iterable[str]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
        """Read the requested photographs."""
        wanted = set(names)
        for file in self.files:
            name = image_name(file.stem)
            if name in wanted:
                yield name, read_upright(file)

    def file_of(self, name: str) -> Path | None:
        """Return the file of a photograph."""
        return next((file for file in self.files if image_name(file.stem) == name), None)


@dataclass(frozen=True)
class Recorded:
    """The images of one camera of a recording, such as a bag; image 12 has the name `0012`.

    `pictures` are None where there is no image; they have (width, height) pixels.
    """

    path: Path
    pictures: tuple[Picture | None, ...]
    size_px: tuple[int, int]

    __repr__ = brief

    @property
    def is_film(self) -> bool:
        """Return True: neighbours show nearly the same."""
        return True

    @cached_property
    def names(self) -> Sequence[str]:
        """Return the names of the images, which are their numbers."""
        return tuple(self._by_name)

    @cached_property
    def _by_name(self) -> dict[str, Picture]:
        digits = max(4, len(str(len(self.pictures) - 1)))
        return {
            f"{index:0{digits}}": picture
            for index, picture in enumerate(self.pictures)
            if picture is not None
        }

    def images(self, names: Iterable[str]) -> Iterator[tuple[str, NDArray[np.uint8]]]:
        """Read the requested images."""
        wanted = set(names)
        for name, picture in self._by_name.items():
            if name in wanted:
                yield name, picture.read(self.size_px)

    def file_of(self, name: str) -> Path | None:  # noqa: ARG002
        """Return None: an image may need a rotation, or be a part of a file."""
        return None


def open_footage(source: str | Path) -> Film | Photographs:
    """Open a video, a folder of photographs, or photographs that match a pattern such as `*.jpg`.

    Raises:
        ScanError: nothing of the kind exists, or two photographs have the same name.
        CaptureError: the video cannot be decoded.

    """
    path = Path(source)
    if path.suffix.lower() in VIDEO_SUFFIXES and not path.is_dir():
        if not path.is_file():
            raise ScanError(f"there is no {path}; name a video, such as film.mp4")
        return Film(path)
    if path.is_dir():
        files = _photos(path.iterdir()) or _photos((path / _FOLDER).glob("*"))
        return _photographs(path, files, f"there is no photograph in {path}")
    found = [Path(name) for name in glob.glob(str(source))]  # noqa: PTH207
    return _photographs(path, _photos(found), f"there is no photograph {path}")


def is_footage(source: str | Path) -> bool:
    """Return whether a path looks like a video or photographs to scan, without reading them."""
    path = Path(source)
    if path.is_dir():
        return bool(_photos(path.iterdir()))
    if path.suffix.lower() in VIDEO_SUFFIXES:
        return True
    return glob.has_magic(str(source)) and path.suffix.lower() in PHOTO_SUFFIXES


def holds_photographs(path: Path) -> bool:
    """Return whether there are photographs in a folder, or in its folder `images`."""
    return path.is_dir() and bool(_photos(path.iterdir()) or _photos((path / _FOLDER).glob("*")))


def image_name(text: str) -> str:
    """Return the image name of a file name; lists of pairs cannot contain blanks."""
    return _BLANK.sub("_", text)


def _photos(paths: Iterable[Path]) -> list[Path]:
    photos = (
        path
        for path in paths
        if path.suffix.lower() in PHOTO_SUFFIXES
        and not path.name.startswith(".")  # some systems leave such files beside images
        and path.is_file()
    )
    return sorted(photos, key=lambda path: f"{image_name(path.stem)}.")


def _photographs(path: Path, files: Sequence[Path], missing: str) -> Photographs:
    if not files:
        raise ScanError(
            f"{missing}; name a video ({', '.join(VIDEO_SUFFIXES)}), a folder of photographs, or a "
            f"pattern such as 'photos/*.jpg' ({', '.join(PHOTO_SUFFIXES)})"
        )
    seen: dict[str, Path] = {}
    for file in files:
        name = image_name(file.stem)
        if name in seen:
            raise ScanError(
                f"{seen[name]} and {file} have the same name without their endings, and with _ for "
                "each blank, which must identify an image; rename one of them"
            )
        seen[name] = file
    return Photographs(path, tuple(files))


Footage = Film | Photographs | Recorded
"""Images of one camera, in the order in which they were taken."""

"""Writes the images of a scan to a folder, upright and of one size, as a capture needs them."""

import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera import (
    WHOLE_BITS,
    Exif,
    dark_words,
    largest_value,
    likely_bits,
    read_exif,
    read_image,
    read_image_size,
)
from servoid.config import IMAGE_FILE, read_bytes
from servoid.errors import ImageError, OutputError
from servoid.scan.footage import Footage

_JPEG_QUALITY = 95
_SAME_FOCAL = 0.02  # share by which the focal lengths in the EXIF data of photographs may differ

Size = tuple[int, int]


@dataclass(frozen=True)
class Staged:
    """Images in a folder: file names in order, their size, and the focal length in EXIF data.

    `doubts` are messages on what makes them unfit for one scan.
    """

    folder: Path
    files: tuple[str, ...]
    size_px: Size
    focal_px: float | None
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Photo:
    """A photograph's file, its size as stored, and its orientation."""

    file: Path
    stored_px: Size
    exif: Exif

    @property
    def upright_px(self) -> Size:
        """Return the size after rotation."""
        width, height = self.stored_px
        return (height, width) if self.exif.is_on_side else (width, height)


def stage(
    footage: Footage,
    names: Iterable[str],
    folder: Path,
    progress: Callable[[float], None] | None = None,
) -> Staged:
    """Write or copy the named images into an empty folder.

    Photographs that need no rotation are copied. If some were held upright and others on their
    side, all stay as stored: a camera has one calibration.

    Raises:
        ImageError: a file is damaged, the images differ in size, or they are nearly black as their
            values have fewer bits than their files.

    """
    chosen = list(names)
    report = progress or (lambda _: None)
    if footage.is_film:
        return _stage_film(footage, chosen, folder, report)
    photos = {name: _look(footage.file_of(name) or footage.path) for name in chosen}
    upright = len({one.upright_px for one in photos.values()}) == 1
    sizes = {n: one.upright_px if upright else one.stored_px for n, one in photos.items()}
    size = _one_size(footage.path, sizes)
    _check_bright([one.file for one in photos.values()])
    files = []
    for done, (name, photo) in enumerate(photos.items(), 1):
        files.append(_stage_photo(folder, name, photo, size))
        report(done / len(photos))
    notes = (
        ()
        if upright
        else (
            "some photographs were held upright and some on their side; all are used as the sensor "
            "recorded them",
        )
    )
    differing = _differing_focals(photos)
    focal_px = None if differing is not None else _noted_focal(photos, size)
    doubts = () if differing is None else (differing,)
    return Staged(folder, tuple(files), size, focal_px, notes, doubts)


def _look(file: Path) -> _Photo:
    return _Photo(file, read_image_size(file), read_exif(read_bytes(file, ImageError, IMAGE_FILE)))


def _stage_film(
    footage: Footage, chosen: list[str], folder: Path, report: Callable[[float], None]
) -> Staged:
    files, size = [], (0, 0)
    for name, image in footage.images(chosen):
        files.append(f"{name}.jpg")
        (folder / files[-1]).write_bytes(encode(image))
        size = (image.shape[1], image.shape[0])
        report(len(files) / len(chosen))
    return Staged(folder, tuple(files), size, None)


def _check_bright(files: Iterable[Path]) -> None:
    """Check that photographs of 16 bits do not use the lower ones only."""
    most, brightest = 0, None
    for file in files:
        largest = largest_value(file)
        if largest is None or likely_bits(largest) == WHOLE_BITS:
            return
        if largest >= most:
            most, brightest = largest, file
    if brightest is not None and most > 0:
        raise ImageError(f"{brightest}: {dark_words(most)}")


def _stage_photo(folder: Path, name: str, photo: _Photo, size: Size) -> str:
    image = read_image(photo.file, size)  # raises if the file is damaged
    if not photo.exif.is_turned:
        file = f"{name}{photo.file.suffix.lower()}"
        shutil.copyfile(photo.file, folder / file)
        return file
    file = f"{name}.jpg"
    (folder / file).write_bytes(encode(image))
    return file


def encode(image: NDArray[np.uint8]) -> bytes:
    """Encode an image (H, W, 3) RGB as the bytes of a JPEG file."""
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
    done, data = cv2.imencode(".jpg", np.ascontiguousarray(image[:, :, ::-1]), options)
    if not done:
        raise OutputError(f"cannot encode an image of shape {image.shape}")
    return data.tobytes()


def _one_size(path: Path, sizes: dict[str, Size]) -> Size:
    """Return the common (width, height) of all images, or raise ImageError."""
    kinds = sorted(set(sizes.values()))
    if len(kinds) == 1:
        return kinds[0]
    first = {kind: next(name for name, size in sizes.items() if size == kind) for kind in kinds}
    listed = ", ".join(f"{width}x{height} ({first[width, height]})" for width, height in kinds[:4])
    raise ImageError(
        f"{path}: the images differ in size: {listed}; a scan needs those of one camera, at one "
        "zoom; move the others elsewhere"
    )


def _noted_focal(photos: dict[str, _Photo], size: Size) -> float | None:
    """Return the focal length in the EXIF data of the photographs, if all have one."""
    noted = [one.exif.focal_px(size) for one in photos.values()]
    known = [one for one in noted if one is not None]
    return float(np.median(known)) if len(known) == len(noted) else None


def _differing_focals(photos: dict[str, _Photo]) -> str | None:
    """Return a doubt if the EXIF data of the photographs have several focal lengths, else None."""
    noted = {name: one.exif.focal_35mm or 0.0 for name, one in photos.items()}
    known = [name for name, focal in noted.items() if focal > 0.0]
    if not known:
        return None
    least, most = min(known, key=noted.__getitem__), max(known, key=noted.__getitem__)
    if noted[most] <= (1.0 + _SAME_FOCAL) * noted[least]:
        return None
    return (
        "the photographs have different focal lengths in their EXIF data, from "
        f"{noted[least]:g} mm ({least}) to {noted[most]:g} mm ({most}): a scan estimates one for "
        "all, so that poses and points are wrong if the zoom or the lens was changed; take "
        "photographs at one zoom, or scan those of each zoom by themselves"
    )

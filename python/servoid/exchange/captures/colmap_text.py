"""Reads `cameras.txt` and `images.txt` of a COLMAP sparse model."""

from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

from servoid.config import COLMAP_FILE, read_text
from servoid.errors import CaptureError
from servoid.exchange.captures.colmap_model import ColmapCamera, ColmapImage
from servoid.words import counted, number_of, whole_number_of

NumberT = TypeVar("NumberT", int, float)

_POINT_VALUES = 3  # x, y, point


def read_cameras_text(path: Path) -> list[ColmapCamera]:
    """Read a cameras.txt: CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS on each line.

    Raises:
        CaptureError: the file is missing, or a line is malformed.

    """
    cameras = []
    for number, line in _lines(path):
        if not _has_content(line):
            continue
        place = f"{path}, line {number}"
        cells = line.split()
        if len(cells) < 5:
            raise CaptureError(
                f"{place}: {counted(len(cells), 'value was', 'values were')} given; a camera is "
                "CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS"
            )
        camera_id, width, height = _numbers(int, [cells[0], *cells[2:4]], place)
        parameters = _numbers(float, cells[4:], place)
        cameras.append(ColmapCamera(camera_id, cells[1], (width, height), parameters))
    return cameras


def read_images_text(path: Path) -> list[ColmapImage]:
    """Read an images.txt: two lines per image, of which the second, its points, is skipped.

    Raises:
        CaptureError: the file is missing, or a line is malformed.

    """
    images = []
    lines = _lines(path)
    for number, line in lines:
        if not _has_content(line):
            continue
        images.append(_read_image(line, f"{path}, line {number}"))
        # The line of points may be empty, and the last one may be missing.
        number, points = next(lines, (number + 1, ""))
        if len(points.split()) % _POINT_VALUES:
            raise CaptureError(
                f"{path}, line {number}: an image's points belong here, three values each or an "
                "empty line; export the model again"
            )
    return images


def _read_image(line: str, place: str) -> ColmapImage:
    cells = line.split(maxsplit=9)
    if len(cells) < 10:
        raise CaptureError(
            f"{place}: {counted(len(cells), 'value was', 'values were')} given; an image is "
            "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
        )
    image_id, camera_id = _numbers(int, [cells[0], cells[8]], place)
    pose = _numbers(float, cells[1:8], place)
    return ColmapImage(image_id, pose[:4], pose[4:], camera_id, cells[9].rstrip())


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    return enumerate(read_text(path, CaptureError, COLMAP_FILE).split("\n"), start=1)


def _has_content(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _numbers(kind: type[NumberT], cells: list[str], place: str) -> tuple[NumberT, ...]:
    numbers = []
    for cell in cells:
        try:
            numbers.append(kind(whole_number_of(cell) if kind is int else number_of(cell)))
        except ValueError as error:
            what = "a whole number" if kind is int else "a number"
            raise CaptureError(f"{place}: '{cell[:40]}' is not {what}") from error
    return tuple(numbers)

"""Reads an image's size from the first bytes of its file, before it is decoded."""

import struct
from pathlib import Path

from servoid.config import IMAGE_FILE, check_regular, read_bytes
from servoid.errors import ImageError

PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8"
"""The first bytes of each file format."""

_TIFF = {b"II*\0": "<", b"MM\0*": ">"}
_TIFF_WIDTH, _TIFF_HEIGHT = 256, 257
_TIFF_SHORT, _TIFF_LONG = 3, 4
_START_BYTES = 1 << 16
_JPEG_NO_SIZE = (0xC4, 0xC8, 0xCC)  # markers of tables, in the range of image headers


def size_in_header(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) from the header of a PNG, JPEG or TIFF file; None for other data."""
    try:
        if data.startswith(PNG):
            width, height = struct.unpack_from(">II", data, 16)
            return width, height
        if data.startswith(JPEG):
            return _jpeg_size(data)
        if data[:4] in _TIFF:
            return _tiff_size(data, _TIFF[data[:4]])
    except struct.error:  # the header is cut short
        return None
    return None


def read_image_size(path: Path) -> tuple[int, int]:
    """Return (width, height) of an image file in pixels, as stored.

    Raises:
        ImageError: the file is missing or not an image.

    """
    check_regular(path, ImageError, IMAGE_FILE)
    size = size_in_header(_read_start(path))
    if size is not None:
        return size
    data = read_bytes(path, ImageError, IMAGE_FILE)
    size = size_in_header(data)
    if size is not None:
        return size
    if not data:
        raise ImageError(f"{path} is empty; replace the file")
    import cv2
    import numpy as np

    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise ImageError(
            f"{path} cannot be decoded: it is no image or it is damaged; replace the file"
        )
    height, width = pixels.shape[:2]
    return width, height


def _read_start(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_START_BYTES)
    except OSError:
        return b""  # reading the whole file reports why


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    at = len(JPEG)
    while True:
        lead, marker, length = struct.unpack_from(">BBH", data, at)
        if lead != 0xFF:
            return None
        if marker == 0xFF:  # a fill byte before the marker
            at += 1
        elif 0xC0 <= marker <= 0xCF and marker not in _JPEG_NO_SIZE:
            height, width = struct.unpack_from(">HH", data, at + 5)
            return width, height
        else:
            at += 2 + length


def _tiff_size(data: bytes, order: str) -> tuple[int, int] | None:
    (at,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, at)
    found: dict[int, int] = {}
    for index in range(count):
        tag, kind = struct.unpack_from(order + "HH", data, at + 2 + 12 * index)
        if tag in (_TIFF_WIDTH, _TIFF_HEIGHT) and kind in (_TIFF_SHORT, _TIFF_LONG):
            form = "H" if kind == _TIFF_SHORT else "I"
            (found[tag],) = struct.unpack_from(order + form, data, at + 2 + 12 * index + 8)
    if len(found) < 2:
        return None
    return found[_TIFF_WIDTH], found[_TIFF_HEIGHT]

"""Reads the orientation and the focal length from the EXIF data of JPEG files."""

import struct
from dataclasses import dataclass

_SEGMENT = b"Exif\0\0"
_APP1, _START_OF_SCAN = 0xE1, 0xDA
_ORIENTATION, _MORE, _FOCAL_35MM = 0x0112, 0x8769, 0xA405
_SHORT, _LONG = 3, 4
_UPRIGHT, _LAST_UPSIDE = 1, 4
_FILM_WIDTH_MM = 36.0


@dataclass(frozen=True)
class Exif:
    """The EXIF fields that servoid uses.

    `orientation` is the EXIF code, 1 (upright as stored) to 8. `focal_35mm` is the focal length
    that gives the same image on film 36 mm wide, in mm.
    """

    orientation: int = _UPRIGHT
    focal_35mm: float | None = None

    @property
    def is_turned(self) -> bool:
        """Return whether the image must be rotated or mirrored before it is shown."""
        return self.orientation != _UPRIGHT

    @property
    def is_on_side(self) -> bool:
        """Return whether the rotation to upright swaps width and height."""
        return self.orientation > _LAST_UPSIDE

    def focal_px(self, size_px: tuple[int, int]) -> float | None:
        """Return the focal length in pixels for images of (width, height), within a few %."""
        if not self.focal_35mm:
            return None
        return self.focal_35mm / _FILM_WIDTH_MM * max(size_px)


def read_exif(data: bytes) -> Exif:
    """Return the EXIF data in the bytes of a JPEG file; defaults if there is none."""
    try:
        block = _find(data)
        return Exif() if block is None else _parse(block)
    except struct.error:  # cut short
        return Exif()


def _find(data: bytes) -> bytes | None:
    """Return the TIFF data in the file's EXIF segment."""
    at = 2
    while data[:2] == b"\xff\xd8":
        lead, marker, length = struct.unpack_from(">BBH", data, at)
        if lead != 0xFF or marker == _START_OF_SCAN:
            return None
        content = data[at + 4 : at + 2 + length]
        if marker == _APP1 and content.startswith(_SEGMENT):
            return content[len(_SEGMENT) :]
        at += 2 + length
    return None


def _parse(block: bytes) -> Exif:
    order = {b"II": "<", b"MM": ">"}.get(block[:2])
    if order is None:
        return Exif()
    (first,) = struct.unpack_from(order + "I", block, 4)
    top = _directory(block, order, first)
    more = _directory(block, order, top[_MORE]) if _MORE in top else {}
    orientation = top.get(_ORIENTATION, _UPRIGHT)
    return Exif(
        orientation=orientation if 1 <= orientation <= 8 else _UPRIGHT,
        focal_35mm=float(more[_FOCAL_35MM]) if more.get(_FOCAL_35MM) else None,
    )


def _directory(block: bytes, order: str, at: int) -> dict[int, int]:
    """Return the entries of a directory that are a single integer, by tag."""
    (count,) = struct.unpack_from(order + "H", block, at)
    found: dict[int, int] = {}
    for index in range(count):
        place = at + 2 + 12 * index
        tag, kind, length = struct.unpack_from(order + "HHI", block, place)
        if length == 1 and kind in (_SHORT, _LONG):
            (found[tag],) = struct.unpack_from(
                order + ("H" if kind == _SHORT else "I"), block, place + 8
            )
    return found

"""Reads images and masks from files; a cut short file is an error."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera
from servoid.camera.bit_depth import WHOLE_BITS, narrowed
from servoid.camera.image_size import JPEG, PNG, read_image_size, size_in_header
from servoid.camera.jpeg_scan import is_scan_damaged
from servoid.camera.label_image import labels_in
from servoid.config import IMAGE_FILE, read_bytes
from servoid.errors import ImageError, MaskError

if TYPE_CHECKING:
    import cv2

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp", ".ppm", ".pgm")
_PNG_BIT_DEPTH = 24  # offset in the file
_OTHER_DEEP = (b"II*\0", b"MM\0*", b"P5", b"P6")  # TIFF, PGM and PPM, whose values may have 16 bits
_PNG_AROUND = 12  # the length, type and checksum of a chunk
_JPEG_START_OF_SCAN = 0xDA
_WITH_ALPHA = 4  # channels
_MOST_REDUCED = 8
_MOST_SHOWN = 6  # values of a mask
_JPEG_END = b"\xff\xd9"


@dataclass(frozen=True)
class Recorded:
    """The size of images in their files, and the factor by which they are shrunk when read."""

    size_px: tuple[int, int]
    by: int = 1


def read_image(
    path: Path,
    size_px: tuple[int, int],
    by: int = 1,
    *,
    upright: bool = False,
    bits: int = WHOLE_BITS,
) -> NDArray[np.uint8]:
    """Read an image of (width, height) pixels as (H, W, 3) uint8 RGB, shrunk `by` a factor.

    Of 16-bit values, which may have fewer `bits`, the upper 8 of these are used.

    The file's EXIF orientation is applied if `upright` is set, or if only the rotated image has
    that size: the camera was then calibrated with rotated images.

    Raises:
        ImageError: the file is missing, cut short, of another size, or not an image.

    """
    import cv2  # takes as long to import as the rest of the package; help texts do not need it

    as_stored = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    flags = cv2.IMREAD_COLOR if upright else as_stored
    pixels = decode(path, flags, size_px, ImageError, by, bits=bits)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def largest_value(path: Path) -> int | None:
    """Return the largest colour value of an image file with 16 bits; None if it has others.

    Raises:
        ImageError: the file is missing, cut short or not an image.

    """
    return largest_in_bytes(read_bytes(path, ImageError, IMAGE_FILE), str(path))


def largest_in_bytes(data: bytes, place: str) -> int | None:
    """Return the largest value of the bytes of an image file, as `largest_value` does.

    Raises:
        ImageError: they are cut short or not an image; `place` begins the message.

    """
    import cv2

    if not data:
        raise ImageError(f"{place} is empty; replace the file")
    is_deep_png = data.startswith(PNG) and data[_PNG_BIT_DEPTH : _PNG_BIT_DEPTH + 1] == b"\x10"
    if not (is_deep_png or data.startswith(_OTHER_DEEP)):
        return None
    pixels = np.asarray(decode_bytes(data, place, cv2.IMREAD_UNCHANGED, None, ImageError))
    if pixels.dtype != np.uint16:
        return None
    return int(pixels.max() if pixels.ndim == 2 else pixels[..., :3].max())


def read_upright(path: Path) -> NDArray[np.uint8]:
    """Read an image of any size as (H, W, 3) uint8 in RGB order, upright.

    The EXIF orientation of the file is applied.

    Raises:
        ImageError: the file is missing, cut short or not an image.

    """
    import cv2

    size = read_image_size(path)
    if max(size) > Camera.MAX_SIDE_PX:
        raise ImageError(
            f"{path} is {size[0]}x{size[1]} pixels; servoid takes at most {Camera.MAX_SIDE_PX} "
            "along a side; shrink it"
        )
    pixels = decode(path, cv2.IMREAD_COLOR, None, ImageError)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def read_mask(path: Path, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
    """Read a mask of (width, height) pixels as (H, W) uint8: 255 on the object, 0 elsewhere.

    It is shrunk `by` a factor, as `shrink_mask` does.

    A pixel belongs to the object if any of its colour channels, of any bit depth, is not zero; the
    alpha channel is ignored. An image of labels, one value for each object, is refused.

    Raises:
        MaskError: the file is missing, cut short, of another size, not an image, or of labels.

    """
    import cv2

    pixels = decode(path, cv2.IMREAD_UNCHANGED, size_px, MaskError)
    _check_one_object(path, pixels if pixels.ndim == 2 else pixels[..., :3])
    object_px = pixels != 0 if pixels.ndim == 2 else (pixels[..., :3] != 0).any(axis=2)
    if pixels.ndim == 3 and pixels.shape[2] == _WITH_ALPHA and not object_px.any():
        _check_alpha(path, pixels[..., 3])
    return shrink_mask(object_px.astype(np.uint8) * np.uint8(255), by)


def _check_one_object(path: Path, pixels: NDArray[np.generic]) -> None:
    """Check that a mask does not give each of several objects a value of its own."""
    words = [str(label) for label in labels_in(pixels)]
    if words:
        shown = words if len(words) <= _MOST_SHOWN else [*words[: _MOST_SHOWN - 1], words[-1]]
        between = " and " if shown == words else " ... "
        raise MaskError(
            f"the mask {path} has areas with the values {', '.join(shown[:-1])}{between}"
            f"{shown[-1]}: which one is the object? Write a mask with that value alone, zero "
            "elsewhere"
        )


def _check_alpha(path: Path, alpha: NDArray[np.generic]) -> None:
    """Check that a mask of zero colours does not store the object in its alpha channel."""
    if alpha.min() != alpha.max():
        raise MaskError(
            f"{path}: all colours of the mask are zero, and the object is in its alpha "
            "channel; save that channel as a grey image, such as with "
            "'magick IN.png -alpha extract OUT.png'"
        )


def shrink_mask(mask: NDArray[np.uint8], by: int) -> NDArray[np.uint8]:
    """Shrink a mask, (H, W) uint8: 255 where at least half of the pixels are set, 0 elsewhere."""
    if by == 1:
        return mask
    return (shrink(mask, by) > 127).astype(np.uint8) * np.uint8(255)


def shrink(pixels: "cv2.typing.MatLike", by: int) -> "cv2.typing.MatLike":
    """Shrink an image: each pixel is the mean of `by` x `by` pixels; the remainder is cut off."""
    if by == 1:
        return pixels
    import cv2

    height, width = (max(1, side // by) for side in pixels.shape[:2])
    whole = pixels[: height * by, : width * by]
    return cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)


def decode(
    path: Path,
    flags: int,
    size_px: tuple[int, int] | None,
    error: type[ImageError] | type[MaskError],
    by: int = 1,
    *,
    bits: int = WHOLE_BITS,
) -> "cv2.typing.MatLike":
    """Decode an image file of (width, height) pixels with OpenCV's `flags`, or raise `error`.

    Without `size_px` any size is accepted. The image is shrunk `by` a power of two. The EXIF
    orientation is applied where only the rotated image has that size. Of 16-bit colours with fewer
    `bits`, the upper 8 of these are used.
    """
    data = read_bytes(path, error, IMAGE_FILE)
    return decode_bytes(data, str(path), flags, size_px, error, by, bits=bits)


def decode_bytes(
    data: bytes,
    place: str,
    flags: int,
    size_px: tuple[int, int] | None,
    error: type[ImageError] | type[MaskError],
    by: int = 1,
    *,
    bits: int = WHOLE_BITS,
) -> "cv2.typing.MatLike":
    """Decode the bytes of an image file as `decode` does; messages name it `place`."""
    import cv2

    as_stored = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    if not data:
        raise error(f"{place} is empty; replace the file")
    end = _end(data)
    if end is None:
        raise error(f"{place} is cut short: its end is missing; copy the file again")
    if data.startswith(JPEG) and is_scan_damaged(data):
        raise error(
            f"{place} is damaged among its pixels: bytes there contradict the JPEG format; copy "
            "the file again"
        )
    data = data[:end]  # the rest may be a PNG chunk with a false, large length
    size = size_in_header(data)
    if size is not None and size_px is not None:  # before a false header can allocate memory
        is_turnable = flags in (as_stored, cv2.IMREAD_COLOR)
        if size == size_px[::-1] != size_px and is_turnable:
            flags = cv2.IMREAD_COLOR
        else:
            check_size(place, size, size_px, error)
    try:
        # A JPEG can be decoded at a half, a quarter or an eighth, which is much faster.
        reduced = min(by, _MOST_REDUCED) if size is not None and data.startswith(JPEG) else 1
        flags |= _reduction(reduced) | (cv2.IMREAD_ANYDEPTH if bits < WHOLE_BITS else 0)
        pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error as reason:
        raise error(f"{place} cannot be decoded as an image: {reason.err}") from reason
    if pixels is None:
        raise error(f"{place} cannot be decoded: {_undecoded(data)}")
    if bits < WHOLE_BITS and pixels.dtype == np.uint16:
        pixels = narrowed(np.asarray(pixels, np.uint16), bits, place)
    height, width = pixels.shape[:2]
    if size_px is None:
        return shrink(pixels, by)
    if reduced == 1:
        check_size(place, (width, height), size_px, error)
        return shrink(pixels, by)
    if size is not None and (width < height) != (size_px[0] < size_px[1]):  # not rotated
        check_size(place, size, size_px, error)
    # The decoder keeps the remainder at the right and bottom; cut it off.
    whole = pixels[: size_px[1] // reduced, : size_px[0] // reduced]
    return shrink(whole, by // reduced)


def _undecoded(data: bytes) -> str:
    """Return why an image file cannot be used, and what to do."""
    import cv2

    try:
        stored = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        stored = None
    if stored is None or stored.dtype in (np.uint8, np.uint16):
        return "it is no image or it is damaged; replace the file"
    return (
        f"its values are of type {stored.dtype}, and nothing says what is dark and bright; store "
        "it with 8 or 16 bits, as whole numbers"
    )


def _reduction(by: int) -> int:

    if by == 1:
        return 0
    return {2: 16, 4: 32, 8: 64}[by]


def check_size(
    path: Path | str,
    found: tuple[int, int],
    size_px: tuple[int, int],
    error: type[ImageError] | type[MaskError],
) -> None:
    """Check that an image has its camera's size, or raise `error`."""
    if found != size_px:
        remedy = (
            "correct size_px with the rest of the calibration, or use the images it was made for"
        )
        if error is MaskError:
            remedy = "give a mask of the size of its image"
        raise error(
            f"{path} is {found[0]}x{found[1]} pixels, but its camera has size_px = "
            f"{list(size_px)}; {remedy}"
        )


def _end(data: bytes) -> int | None:
    """Return the offset at which an image ends; None for a PNG or JPEG whose end is missing.

    Decoders fill in missing data without an error.
    """
    if data.startswith(PNG):
        return _png_end(data)
    if not data.startswith(JPEG):
        return len(data)
    # The segments come first, each with its length; an embedded preview has an end of its own.
    at = len(JPEG)
    while data[at : at + 1] == b"\xff" and data[at + 1 : at + 2] != bytes([_JPEG_START_OF_SCAN]):
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return len(data) if data.find(_JPEG_END, at) >= 0 else None


def _png_end(data: bytes) -> int | None:
    """Return the offset at which a PNG's last chunk ends; None if its chunks overrun the file.

    OpenCV allocates as many bytes as a chunk claims to have before it reads them.
    """
    at = len(PNG)
    while at + _PNG_AROUND <= len(data):
        kind = data[at + 4 : at + 8]
        at += _PNG_AROUND + int.from_bytes(data[at : at + 4], "big")
        if kind == b"IEND":
            return at if at <= len(data) else None
    return None

"""Decodes image messages to pixels, for each ROS encoding."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from servoid.camera import (
    WHOLE_BITS,
    check_size,
    decode_bytes,
    largest_in_bytes,
    narrowed,
    shrink,
    size_in_header,
)
from servoid.errors import ImageError

if TYPE_CHECKING:
    import cv2

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"

_DEPTH_SCALES_M = {"16UC1": 1e-3, "mono16": 1e-3, "32FC1": 1.0}
_DEPTH_ENCODINGS = ("16UC1", "32FC1")
_PARAMETERS = 12  # bytes before a depth image: its format and quantization
_PNG_DEPTH = "png"
_NAMED_DEPTH = "depth"  # in the name of a topic


@dataclass(frozen=True)
class Encoding:
    """A pixel format: numbers of type `kind`, the number of `channels`, and the conversion to RGB.

    `conversion` is the name of OpenCV's conversion to RGB, empty if none is needed.
    """

    kind: str
    channels: int
    conversion: str = ""


# OpenCV names a Bayer pattern from the second row and column, ROS from the first.
ENCODINGS = {
    "mono8": Encoding("u1", 1, "COLOR_GRAY2RGB"),
    "8UC1": Encoding("u1", 1, "COLOR_GRAY2RGB"),
    "mono16": Encoding("u2", 1, "COLOR_GRAY2RGB"),
    "rgb8": Encoding("u1", 3),
    "bgr8": Encoding("u1", 3, "COLOR_BGR2RGB"),
    "8UC3": Encoding("u1", 3, "COLOR_BGR2RGB"),
    "rgba8": Encoding("u1", 4, "COLOR_RGBA2RGB"),
    "bgra8": Encoding("u1", 4, "COLOR_BGRA2RGB"),
    "8UC4": Encoding("u1", 4, "COLOR_BGRA2RGB"),
    "rgb16": Encoding("u2", 3),
    "bgr16": Encoding("u2", 3, "COLOR_BGR2RGB"),
    "bayer_rggb8": Encoding("u1", 1, "COLOR_BayerBG2RGB"),
    "bayer_bggr8": Encoding("u1", 1, "COLOR_BayerRG2RGB"),
    "bayer_gbrg8": Encoding("u1", 1, "COLOR_BayerGR2RGB"),
    "bayer_grbg8": Encoding("u1", 1, "COLOR_BayerGB2RGB"),
    "yuv422": Encoding("u1", 2, "COLOR_YUV2RGB_UYVY"),
    "uyvy": Encoding("u1", 2, "COLOR_YUV2RGB_UYVY"),
    "yuv422_yuy2": Encoding("u1", 2, "COLOR_YUV2RGB_YUY2"),
    "yuyv": Encoding("u1", 2, "COLOR_YUV2RGB_YUY2"),
}
_DEPTHS = {"16UC1": Encoding("u2", 1), "mono16": Encoding("u2", 1), "32FC1": Encoding("f4", 1)}


def is_depth(image: Any, topic: str) -> bool:
    """Return whether an image, decoded to a message, contains distances and not colours.

    Some drivers send depth with the encoding of grey images; then the topic's name tells.
    """
    if hasattr(image, "encoding"):
        is_named = image.encoding in _DEPTHS and _NAMED_DEPTH in topic.lower()
        return is_named or image.encoding in _DEPTH_ENCODINGS
    return is_compressed_depth(topic) or _first_word(image) in _DEPTH_ENCODINGS


def is_compressed_depth(topic: str) -> bool:
    """Return whether a topic has compressed depth images with parameters before them."""
    return topic.endswith("/compressedDepth")


def size_of(image: Any, topic: str) -> tuple[int, int] | None:
    """Return width and height of an image, decoded to a message; None if unknown."""
    if hasattr(image, "encoding"):
        return int(image.width), int(image.height)
    skipped = _PARAMETERS if is_compressed_depth(topic) else 0
    return size_in_header(bytes(image.data[skipped:]))


def largest_color(image: Any, place: str) -> int | None:
    """Return the largest value of an image, decoded to a message, with 16 bits; None if of others.

    Raises:
        ImageError: the data are damaged; `place` begins the message.

    """
    if not hasattr(image, "encoding"):
        return largest_in_bytes(bytes(image.data), place)
    encoding = ENCODINGS.get(image.encoding)
    if encoding is None or encoding.kind != "u2":
        return None
    return int(_array_of(image, encoding, place).max(initial=0))


def colors_of(
    image: Any, size_px: tuple[int, int], place: str, by: int = 1, *, bits: int = WHOLE_BITS
) -> NDArray[np.uint8]:
    """Return the pixels of an image, decoded to a message: (H, W, 3) uint8, RGB, shrunk `by`.

    It has (width, height) pixels. Of 16-bit values, which may have fewer `bits`, the upper 8 of
    these are used.

    Raises:
        ImageError: the encoding is unknown, the data are damaged, or it has another size; `place`
            begins the message.

    """
    import cv2

    if not hasattr(image, "encoding"):
        flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        data = bytes(image.data)
        found = decode_bytes(data, place, flags, size_px, ImageError, by, bits=bits)
        # The word after `compressed` is the channel order that the encoder was given.
        is_swapped = "compressed rgb" in image.format
        return np.asarray(found if is_swapped else cv2.cvtColor(found, cv2.COLOR_BGR2RGB), np.uint8)
    check_size(place, (int(image.width), int(image.height)), size_px, ImageError)
    encoding = ENCODINGS.get(image.encoding)
    if encoding is None:
        raise ImageError(
            f"{place}: its encoding is '{image.encoding}'; servoid reads {', '.join(ENCODINGS)}, "
            f"and as depth {' and '.join(_DEPTH_ENCODINGS)}; republish it in one of these"
        )
    pixels = _array_of(image, encoding, place)
    if pixels.dtype == np.uint16:
        pixels = narrowed(pixels, bits, place)
    if encoding.conversion:
        pixels = _converted(pixels, getattr(cv2, encoding.conversion), place)
    return np.ascontiguousarray(shrink(pixels, by), dtype=np.uint8)


def depth_of(
    image: Any, topic: str, size_px: tuple[int, int], place: str
) -> tuple[NDArray[np.generic], float]:
    """Return the values of a depth image, (H, W), and their unit in metres.

    Raises:
        ImageError: it is not a depth image, the data are damaged, or it has another size; `place`
            begins the message.

    """
    if hasattr(image, "encoding"):
        if image.encoding not in _DEPTHS:
            raise ImageError(
                f"{place}: its encoding is '{image.encoding}'; depth images have "
                f"{' or '.join(_DEPTH_ENCODINGS)}"
            )
        check_size(place, (int(image.width), int(image.height)), size_px, ImageError)
        return _array_of(image, _DEPTHS[image.encoding], place), _DEPTH_SCALES_M[image.encoding]
    if is_compressed_depth(topic):
        return _unquantized(image, size_px, place)
    return _stored(bytes(image.data), size_px, place), _DEPTH_SCALES_M["16UC1"]


def _array_of(image: Any, encoding: Encoding, place: str) -> NDArray[Any]:
    """Return the stored array: (H, W) or (H, W, C), without row padding."""
    kind = np.dtype(f"{'>' if image.is_bigendian else '<'}{encoding.kind}")
    width, height, step = int(image.width), int(image.height), int(image.step)
    row = width * encoding.channels * kind.itemsize
    if width < 1 or height < 1 or step < row or len(image.data) < step * (height - 1) + row:
        raise ImageError(
            f"{place}: {len(image.data)} bytes with {step} a row are not an {image.encoding} image "
            f"of {width}x{height} pixels; record it again"
        )
    data = np.asarray(image.data, np.uint8)
    if len(data) < step * height:  # some drivers omit the padding of the last row
        data = np.concatenate([data, np.zeros(step * height - len(data), np.uint8)])
    rows = np.ascontiguousarray(data[: step * height].reshape(height, step)[:, :row])
    numbers = rows.view(kind).astype(kind.newbyteorder("="), copy=False)
    if encoding.channels == 1:
        return numbers
    return numbers.reshape(height, width, encoding.channels)


def _unquantized(
    image: Any, size_px: tuple[int, int], place: str
) -> tuple[NDArray[np.generic], float]:
    """Decode compressed_depth_image_transport: floats are stored as inverse distances."""
    data = bytes(image.data)
    if _PNG_DEPTH not in image.format and " " in image.format:
        raise ImageError(
            f"{place}: its format is '{image.format}'; servoid reads compressed depth as PNG; "
            "republish it with compressed_depth_image_transport/format set to png"
        )
    stored = _stored(data[_PARAMETERS:], size_px, place)
    if _first_word(image) != "32FC1":
        return stored, _DEPTH_SCALES_M["16UC1"]
    near, offset = (float(one) for one in np.frombuffer(data, "<f4", count=2, offset=4))
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = near / (stored.astype(np.float64) - offset)
    distances[stored == 0] = np.nan
    return distances.astype(np.float32), _DEPTH_SCALES_M["32FC1"]


def _converted(pixels: NDArray[Any], conversion: int, place: str) -> "cv2.typing.MatLike":
    import cv2

    try:
        return cv2.cvtColor(pixels, conversion)
    except cv2.error as reason:
        raise ImageError(f"{place} has no size of its encoding: {reason.err}") from reason


def _stored(data: bytes, size_px: tuple[int, int], place: str) -> NDArray[np.generic]:
    import cv2

    pixels = decode_bytes(data, place, cv2.IMREAD_UNCHANGED, size_px, ImageError)
    if pixels.ndim != 2 or pixels.dtype == np.uint8:
        raise ImageError(
            f"{place} has {pixels.dtype} and shape {pixels.shape}; a depth image has one channel "
            "of 16 bits"
        )
    return pixels


def _first_word(image: Any) -> str:
    return str(image.format).split(";")[0].strip()

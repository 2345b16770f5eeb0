"""Decodes image buffers of industrial cameras, by GenICam pixel format."""

import numpy as np
from numpy.typing import NDArray

from servoid.errors import CaptureError

# The code of a format in an image's header, its name, the type of a sample, the number of samples
# per pixel, and by how many bits samples are shifted to fill their type.
_TABLE: tuple[tuple[int, str, type, int, int], ...] = (
    (0x01080001, "Mono8", np.uint8, 1, 0),
    (0x01100003, "Mono10", np.uint16, 1, 6),
    (0x01100005, "Mono12", np.uint16, 1, 4),
    (0x01100025, "Mono14", np.uint16, 1, 2),
    (0x01100007, "Mono16", np.uint16, 1, 0),
    (0x01080008, "BayerGR8", np.uint8, 1, 0),
    (0x01080009, "BayerRG8", np.uint8, 1, 0),
    (0x0108000A, "BayerGB8", np.uint8, 1, 0),
    (0x0108000B, "BayerBG8", np.uint8, 1, 0),
    (0x02180014, "RGB8", np.uint8, 3, 0),
    (0x02180015, "BGR8", np.uint8, 3, 0),
    (0x02100032, "YUV422_8", np.uint8, 2, 0),
    (0x0210001F, "YUV422_8_UYVY", np.uint8, 2, 0),
)
_BY_CODE = {row[0]: row for row in _TABLE}
FORMATS = tuple(row[1] for row in _TABLE)
"""The names of the supported pixel formats."""


def format_name(code: int) -> str:
    """Return the name of a pixel format, or its code if it is not one of `FORMATS`."""
    return _BY_CODE[code][1] if code in _BY_CODE else f"0x{code:08X}"


def decode_pixels(
    data: bytes, code: int, size_px: tuple[int, int], padding: int = 0
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Decode the image in a buffer: (H, W), or (H, W, 3) in BGR order, uint8 or uint16.

    `code` is the pixel format's code, `size_px` is (width, height), `padding` the bytes after each
    row. Samples of 10 to 14 bits are shifted to 16.

    Raises:
        CaptureError: the format is not one of `FORMATS`, or bytes are missing.

    """
    if code not in _BY_CODE:
        raise CaptureError(refused_format(format_name(code)))
    _, name, kind, samples, shift = _BY_CODE[code]
    width, height = size_px
    row_bytes = width * samples * np.dtype(kind).itemsize
    if len(data) < height * (row_bytes + padding) - padding:
        raise CaptureError(
            f"an image of {width}x{height} pixels in {name} has {height * row_bytes} bytes, but "
            f"{len(data)} came"
        )
    whole = np.frombuffer(data, np.uint8).copy()
    whole.resize(height * (row_bytes + padding))  # the last row may lack its padding
    rows = np.ascontiguousarray(whole.reshape(height, row_bytes + padding)[:, :row_bytes])
    pixels = rows.view(kind).reshape(height, width, samples)
    return _image(name, pixels << shift if shift else pixels)


def refused_format(name: str) -> str:
    """Make the message that a pixel format is not supported, with the supported ones."""
    return (
        f"the pixel format {name} cannot be read; set the camera's PixelFormat to one of "
        f"{', '.join(FORMATS)}"
    )


def _image(name: str, pixels: NDArray) -> NDArray:
    """Return (H, W, samples) as grey or BGR."""
    import cv2

    if name.startswith("Bayer"):
        # GenICam names a Bayer pattern by the first two pixels of the first row.
        pattern = {"GR": "GRBG", "RG": "RGGB", "GB": "GBRG", "BG": "BGGR"}[name[5:7]]
        return cv2.cvtColor(pixels[..., 0], getattr(cv2, f"COLOR_BAYER_{pattern}2BGR"))
    if name.startswith("YUV"):
        order = "UYVY" if name.endswith("UYVY") else "YUYV"
        return cv2.cvtColor(pixels, getattr(cv2, f"COLOR_YUV2BGR_{order}"))
    if name == "RGB8":
        return np.ascontiguousarray(pixels[..., ::-1])
    return pixels[..., 0] if pixels.shape[2] == 1 else pixels

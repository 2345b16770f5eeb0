"""Reads the endless JPEG images that a camera or a phone sends over HTTP."""

import math
import re
import urllib.request
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from email.message import Message
from http.client import HTTPException
from typing import Protocol
from urllib.error import URLError
from urllib.parse import unquote, urlsplit, urlunsplit

import numpy as np

from servoid.camera import Camera, size_in_header
from servoid.config import STREAM_IMAGE
from servoid.errors import CaptureError
from servoid.source.delivery import Delivery, LostDeviceError
from servoid.words import reason_of

_KIND = "multipart/x-mixed-replace"
_PAGES = ("text/html", "application/xhtml+xml")
_TIMEOUT_S = 3.0  # within which bytes must arrive; a camera that is gone sends nothing
_MOST_LINES = 64  # of the header before an image
_LONGEST_LINE = 8192
_STAMPS = ("X-Timestamp", "X-TimeStamp", "X-Time-Stamp")
_SECONDS = re.compile(r"\s*([0-9]+(?:\.[0-9]+)?)\s*")
_JPEG_END = b"\xff\xd9"
_ENDED = "the stream ended"


class _Answer(Protocol):
    """The part of an HTTP response that is used here."""

    headers: Message

    def readline(self, limit: int = ..., /) -> bytes: ...
    def read(self, count: int = ..., /) -> bytes: ...
    def close(self) -> None: ...


class NoImagesError(CaptureError):
    """Is raised for an address that answers with something else than images."""


@dataclass(frozen=True, eq=False)
class JpegDelivery(Delivery):
    """An image with the bytes of its JPEG file."""

    encoded: bytes = b""


class MjpegVideo:
    """Delivers the images of a stream like `cv2.VideoCapture`, each as soon as it has arrived.

    If the sender reports capture times on its own clock, the delivery has that timestamp.
    """

    def __init__(self, answer: _Answer) -> None:
        """Read from the response of an address."""
        self._answer = answer
        self._encoded, self._heads = b"", dict[str, str]()
        boundary = str(answer.headers.get_param("boundary") or "")
        self._mark = b"--" + boundary.strip('"').removeprefix("--").encode("latin-1", "replace")

    def grab(self) -> bool:
        """Wait for the next image.

        Raises:
            LostDeviceError: the stream ended or broke, nothing came for too long, or the content is
                not a sequence of images.

        """
        try:
            self._heads = self._next_heads()
            length = self._heads.get("content-length", "")
            self._encoded = self._exactly(int(length)) if length.isdigit() else self._to_mark()
        except (OSError, HTTPException, ValueError) as error:
            raise LostDeviceError(failure_of(error)) from error
        return True

    def retrieve(self) -> tuple[bool, JpegDelivery | None]:
        """Return whether the image could be decoded, and it: (H, W, 3) uint8, in BGR order."""
        import cv2

        flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        if not self._encoded.rstrip(b"\r\n\0").endswith(_JPEG_END):
            return False, None  # a decoder would fill in the missing part
        if max(size_in_header(self._encoded) or (0, 0)) > Camera.MAX_SIDE_PX:
            return False, None  # it would allocate whatever a damaged header claims
        try:
            pixels = cv2.imdecode(np.frombuffer(self._encoded, np.uint8), flags)
        except cv2.error:
            pixels = None
        if pixels is None:
            return False, None
        return True, JpegDelivery((pixels,), _stamp_s(self._heads), encoded=self._encoded)

    def release(self) -> None:
        """Close the connection."""
        self._answer.close()

    def _next_heads(self) -> Mapping[str, str]:
        """Read to the end of the header before an image; names are in lowercase.

        Lines before the boundary, such as the end of the previous image, are skipped.
        """
        while True:
            line = self._line()
            if line.startswith(self._mark):
                break
        heads: dict[str, str] = {}
        for _ in range(_MOST_LINES):
            name, colon, value = self._line().decode("latin-1").partition(":")
            if not colon:
                return heads
            heads[name.strip().lower()] = value.strip()
        raise LostDeviceError("the header before an image has no end")

    def _line(self) -> bytes:
        line = self._answer.readline(_LONGEST_LINE)
        if not line:
            raise LostDeviceError(_ENDED)
        return line.strip()

    def _exactly(self, count: int) -> bytes:
        if count > STREAM_IMAGE.most_bytes:
            raise LostDeviceError(f"the stream announces an image of {count >> 20} MiB")
        data = bytearray()
        while len(data) < count:
            part = self._answer.read(count - len(data))
            if not part:
                raise LostDeviceError(_ENDED)
            data += part
        return bytes(data)

    def _to_mark(self) -> bytes:
        """Read an image of unknown length: up to its end, which precedes a boundary."""
        data = bytearray()
        while len(data) < STREAM_IMAGE.most_bytes:
            line = self._answer.readline(_LONGEST_LINE)
            if not line:
                raise LostDeviceError(_ENDED)
            data += line
            end = data.rfind(_JPEG_END, -len(line) - len(_JPEG_END))
            if end >= 0 and not data[end + len(_JPEG_END) :].strip(b"\r\n"):
                return bytes(data[: end + len(_JPEG_END)])
        raise LostDeviceError(f"the stream has an image of more than {STREAM_IMAGE.text}")


def open_mjpeg(address: str) -> MjpegVideo | None:
    """Open an http:// or https:// address; None if it does not send endless images.

    Raises:
        OSError: the address does not answer, or refuses.
        NoImagesError: it answers with a page.

    """
    parts = urlsplit(address)
    host = parts.netloc.rpartition("@")[2]
    request = urllib.request.Request(urlunsplit((parts.scheme, host, *parts[2:4], "")))
    if parts.username is not None:
        word = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
        request.add_unredirected_header("Authorization", f"Basic {b64encode(word).decode()}")
    answer = urllib.request.urlopen(request, timeout=_TIMEOUT_S)
    kind = answer.headers.get_content_type()
    if kind == _KIND:
        return MjpegVideo(answer)
    answer.close()
    if kind in _PAGES:
        raise NoImagesError(
            f"was reached, but answers {kind}, which is a page and no images; give the address of "
            f"its stream, which answers {_KIND}: often /video, /stream or /mjpeg; a page may also "
            "ask for a login, which is written http://NAME:PASSWORD@..."
        )
    return None


def _stamp_s(heads: Mapping[str, str]) -> float | None:
    for name in _STAMPS:
        seconds = _SECONDS.fullmatch(heads.get(name.lower(), ""))
        if seconds is not None and math.isfinite(float(seconds[1])):
            return float(seconds[1])
    return None


def failure_of(error: Exception) -> str:
    """Return in few words why a connection failed."""
    reason = error.reason if isinstance(error, URLError) else error
    if isinstance(reason, TimeoutError):
        return "nothing came for too long"
    return reason_of(reason) if isinstance(reason, OSError) and reason.strerror else str(reason)

"""Reads `cameras.bin` and `images.bin` of a COLMAP sparse model."""

import struct
from pathlib import Path

from servoid.config import COLMAP_FILE, read_bytes
from servoid.errors import CaptureError
from servoid.exchange.captures.colmap_model import (
    MODEL_NAMES,
    ColmapCamera,
    ColmapImage,
    parameter_count,
)
from servoid.words import counted

_CAMERA_HEAD = struct.Struct("<IiQQ")  # id, model, width, height
_IMAGE_HEAD = struct.Struct("<I7dI")  # id, quaternion, translation, camera
_POINT_BYTES = 24  # x, y, point


def read_cameras_binary(path: Path) -> list[ColmapCamera]:
    """Read a cameras.bin.

    Raises:
        CaptureError: the file is missing or cut short, a count is wrong, or a model is unsupported.

    """
    file = _Binary(path)
    cameras = []
    for _ in range(file.count(_CAMERA_HEAD.size, "cameras")):
        camera_id, model_id, width, height = file.take(_CAMERA_HEAD)
        place = f"{path}, camera {camera_id}"
        model = MODEL_NAMES.get(model_id, f"number {model_id}")
        numbers = file.take(struct.Struct(f"<{parameter_count(model, place)}d"))
        cameras.append(ColmapCamera(camera_id, model, (width, height), numbers))
    file.check_end()
    return cameras


def read_images_binary(path: Path) -> list[ColmapImage]:
    """Read an images.bin; the points seen in the images are skipped.

    Raises:
        CaptureError: the file is missing or cut short, or a count is wrong.

    """
    file = _Binary(path)
    images = []
    least = _IMAGE_HEAD.size + 1 + 8  # an empty name, and the count of points
    for _ in range(file.count(least, "images")):
        image_id, *pose, camera_id = file.take(_IMAGE_HEAD)
        name = file.text(f"the name of image {image_id}")
        file.skip(file.count(_POINT_BYTES, f"points of image {image_id}") * _POINT_BYTES)
        images.append(ColmapImage(image_id, tuple(pose[:4]), tuple(pose[4:]), camera_id, name))
    file.check_end()
    return images


class _Binary:
    """Reads values from a file's bytes in sequence, and never beyond their end."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._data = read_bytes(path, CaptureError, COLMAP_FILE)
        self._at = 0

    def take(self, form: struct.Struct) -> tuple:
        start = self._at
        self.skip(form.size)
        return form.unpack_from(self._data, start)

    def count(self, least_bytes: int, what: str) -> int:
        """Read a count of items that take at least `least_bytes` each."""
        (count,) = self.take(struct.Struct("<Q"))
        room = len(self._data) - self._at
        if count * least_bytes > room:
            raise CaptureError(
                f"{self._path} claims {count} {what}, but only {room} bytes follow: it is cut "
                "short, or not a COLMAP file; export the model again"
            )
        return count

    def text(self, what: str) -> str:
        end = self._data.find(b"\0", self._at)
        if end < 0:
            raise self._cut_short()
        start, self._at = self._at, end + 1
        try:
            return self._data[start:end].decode("utf-8")
        except UnicodeDecodeError as error:
            raise CaptureError(f"{self._path}: {what} is not UTF-8; rename the file") from error

    def skip(self, count: int) -> None:
        if len(self._data) - self._at < count:
            raise self._cut_short()
        self._at += count

    def check_end(self) -> None:
        rest = len(self._data) - self._at
        if rest:
            raise CaptureError(
                f"{self._path}: {counted(rest, 'byte follows', 'bytes follow')} the last entry, "
                "so a count in it is wrong or it is not a COLMAP file; export the model again"
            )

    def _cut_short(self) -> CaptureError:
        return CaptureError(
            f"{self._path} is cut short after {counted(len(self._data), 'byte')}; copy the file "
            "again"
        )

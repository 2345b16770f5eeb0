"""Images that were taken with a turned camera: EXIF data of photographs, headers of videos."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.camera import read_image
from servoid.camera.exif import read_exif
from servoid.camera.images import read_upright
from servoid.camera.video import read_video_image, upright_images
from servoid.errors import ImageError

STORED = (48, 32)  # width and height of what the sensor recorded
UPRIGHT = (32, 48)
TURN_RIGHT = 6  # EXIF: turn by 90 degrees to the right
FOCAL_35MM = 28


def scene() -> NDArray[np.uint8]:
    """Return what a sensor recorded (H, W, 3) RGB: its corners differ."""
    image = np.full((STORED[1], STORED[0], 3), 90, np.uint8)
    image[:16, :16] = (230, 40, 40)
    image[:16, -16:] = (40, 230, 40)
    image[-16:, :16] = (40, 40, 230)
    return image


def exif(orientation: int, order: str = "<") -> bytes:
    """Return an EXIF segment that notes an orientation and a focal length."""
    mark = b"II" if order == "<" else b"MM"
    head = mark + struct.pack(order + "HI", 42, 8)
    top = struct.pack(order + "H", 2)
    top += struct.pack(order + "HHIHH", 0x0112, 3, 1, orientation, 0)
    top += struct.pack(order + "HHII", 0x8769, 4, 1, 8 + 2 + 24 + 4) + struct.pack(order + "I", 0)
    more = struct.pack(order + "H", 1)
    more += struct.pack(order + "HHIHH", 0xA405, 3, 1, FOCAL_35MM, 0) + struct.pack(order + "I", 0)
    content = b"Exif\0\0" + head + top + more
    return b"\xff\xe1" + struct.pack(">H", len(content) + 2) + content


def write_photo(path: Path, orientation: int, order: str = "<") -> Path:
    done, data = cv2.imencode(".jpg", scene()[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])
    assert done
    path.write_bytes(data.tobytes()[:2] + exif(orientation, order) + data.tobytes()[2:])
    return path


def write_turned_film(path: Path) -> Path:
    """Write a video whose header asks for a turn by 90 degrees to the right."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 25.0, STORED)
    for _ in range(3):
        writer.write(np.ascontiguousarray(scene()[:, :, ::-1]))
    writer.release()
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # version and flags, and what stands before the matrix
    one = 1 << 16
    data[at : at + 36] = struct.pack(">9i", 0, one, 0, -one, 0, 0, STORED[1] * one, 0, 1 << 30)
    path.write_bytes(bytes(data))
    return path


def assert_like(image: NDArray[np.uint8], wanted: NDArray[np.uint8]) -> None:
    assert image.shape == wanted.shape
    assert np.abs(image.astype(float) - wanted).mean() < 12.0


@pytest.mark.parametrize("order", ["<", ">"])
def test_exif_data_notes_turn_and_lens(tmp_path: Path, order: str) -> None:
    noted = read_exif(write_photo(tmp_path / "a.jpg", TURN_RIGHT, order).read_bytes())
    assert noted.orientation == TURN_RIGHT and noted.is_turned
    assert noted.focal_px((3600, 2400)) == pytest.approx(FOCAL_35MM / 36 * 3600)


@pytest.mark.parametrize("length", [0, 3, 20, 40, 60, 80])
def test_exif_data_that_is_cut_short_says_nothing_or_what_is_left(
    tmp_path: Path, length: int
) -> None:
    data = write_photo(tmp_path / "a.jpg", TURN_RIGHT).read_bytes()
    assert read_exif(data[:length]).orientation in (1, TURN_RIGHT)


def test_a_photograph_is_upright_as_people_see_it(tmp_path: Path) -> None:
    photo = write_photo(tmp_path / "a.jpg", TURN_RIGHT)
    assert_like(read_upright(photo), np.rot90(scene(), -1))


def test_a_photograph_is_turned_where_only_so_it_has_the_cameras_size(tmp_path: Path) -> None:
    photo = write_photo(tmp_path / "a.jpg", TURN_RIGHT)
    assert_like(read_image(photo, STORED), scene())
    assert_like(read_image(photo, UPRIGHT), np.rot90(scene(), -1))
    half = read_image(photo, UPRIGHT, by=2)
    assert half.shape == (UPRIGHT[1] // 2, UPRIGHT[0] // 2, 3)


@pytest.mark.parametrize("by", [1, 2])
def test_a_photograph_that_no_turn_makes_fit_is_refused(tmp_path: Path, by: int) -> None:
    photo = write_photo(tmp_path / "a.jpg", 1)
    with pytest.raises(ImageError, match="48x32 pixels"):
        read_image(photo, UPRIGHT, by=by)


def test_a_video_is_turned_where_only_so_it_has_the_cameras_size(tmp_path: Path) -> None:
    film = write_turned_film(tmp_path / "film.mp4")
    upright = list(upright_images(film))
    assert len(upright) == 3
    assert_like(upright[0], np.rot90(scene(), -1))
    assert_like(read_video_image(film, 1, UPRIGHT), upright[1])
    assert_like(read_video_image(film, 1, STORED), scene())

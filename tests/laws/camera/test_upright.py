"""Images that were taken with a turned camera: EXIF data of photographs, headers of videos."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.camera import Picture, read_image
from servoid.camera.exif import read_exif
from servoid.camera.images import read_upright
from servoid.camera.video import read_video_image, upright_images
from servoid.errors import ImageError
from servoid.exchange.bags.mcap.raw_images import raw_image
from servoid.opening import GivenCalibration, open_recorded, parse_source

STORED = (48, 32)  # width and height of what the sensor recorded
UPRIGHT = (32, 48)
TURN_RIGHT = 6  # EXIF: turn by 90 degrees to the right
UPSIDE_DOWN = 3
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


def write_turned_film(path: Path, *, upside_down: bool = False) -> Path:
    """Write a video whose header asks for a turn by 90 degrees to the right, or by 180."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 25.0, STORED)
    for _ in range(3):
        writer.write(np.ascontiguousarray(scene()[:, :, ::-1]))
    writer.release()
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # version and flags, and what stands before the matrix
    one = 1 << 16
    matrix = (0, one, 0, -one, 0, 0, STORED[1] * one, 0, 1 << 30)
    if upside_down:
        matrix = (-one, 0, 0, 0, -one, 0, STORED[0] * one, STORED[1] * one, 1 << 30)
    data[at : at + 36] = struct.pack(">9i", *matrix)
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


def first_image(source: Path, known: GivenCalibration) -> NDArray[np.uint8]:
    """Return the first image of a source as `track`, `model` and `pick` see it."""
    (camera,) = open_recorded(parse_source(str(source)), known).capture.cameras
    picture = camera.pictures[0]
    assert picture is not None
    return picture.read(camera.lens.size_px)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_source_of_photographs_shows_them_as_a_scan_does(
    tmp_path: Path, orientation: int
) -> None:
    photo = write_photo(tmp_path / "a.jpg", orientation)
    assert_like(first_image(tmp_path, GivenCalibration(fov_deg=60.0)), read_upright(photo))


@pytest.mark.parametrize("upside_down", [False, True])
def test_a_source_of_a_video_shows_it_as_a_scan_does(tmp_path: Path, upside_down: bool) -> None:
    film = write_turned_film(tmp_path / "film.mp4", upside_down=upside_down)
    assert_like(first_image(film, GivenCalibration(fov_deg=60.0)), next(upright_images(film)))
    assert_like(next(upright_images(film)), np.rot90(scene(), 2 if upside_down else -1))


def test_a_calibration_is_of_images_as_they_are_stored(tmp_path: Path) -> None:
    film = write_turned_film(tmp_path / "film.mp4", upside_down=True)
    calibration = tmp_path / "rig.toml"
    calibration.write_text(
        f'version = 1\n[[camera]]\nname = "eye"\nsize_px = {list(STORED)}\nfov_deg = 60.0\n'
    )
    known = GivenCalibration(calibration=calibration)
    assert_like(first_image(film, known), scene())
    (note,) = open_recorded(parse_source(str(film)), known).notes
    assert "requests a rotation by 180 degrees for display, which is not applied" in note


def test_a_recording_of_upside_down_photographs_is_upright(tmp_path: Path) -> None:
    photo = write_photo(tmp_path / "a.jpg", UPSIDE_DOWN)
    (camera,) = open_recorded(
        parse_source(str(tmp_path)), GivenCalibration(fov_deg=60.0)
    ).capture.cameras
    upright = raw_image(camera, camera.pictures[0])
    stored = raw_image(camera, Picture(photo))
    assert upright is not None and stored is not None
    assert_like(upright.data, np.rot90(scene(), 2))
    assert stored.data == photo.read_bytes()

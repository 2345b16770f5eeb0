"""JPEGs whose coded pixels are damaged are refused, and no whole one is."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from servoid.camera import read_image
from servoid.camera.jpeg_scan import is_scan_damaged
from servoid.errors import ImageError

SIZE_PX = (96, 64)
DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
KINDS = {
    "plain": [],
    "restarts": [cv2.IMWRITE_JPEG_RST_INTERVAL, 1],
    "progressive": [cv2.IMWRITE_JPEG_PROGRESSIVE, 1],
    "progressive with restarts": [
        cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_RST_INTERVAL, 2,
    ],
    "optimized": [cv2.IMWRITE_JPEG_OPTIMIZE, 1],
    "coarse": [cv2.IMWRITE_JPEG_QUALITY, 5],
    "fine": [cv2.IMWRITE_JPEG_QUALITY, 100],
}  # fmt: skip


def encoded(kind: str, seed: int = 0, *, grey: bool = False) -> bytes:
    rng = np.random.default_rng(seed)
    shape = SIZE_PX[::-1] if grey else (*SIZE_PX[::-1], 3)
    pixels = cv2.GaussianBlur(rng.integers(0, 255, shape).astype(np.uint8), (0, 0), 1 + seed % 3)
    done, data = cv2.imencode(".jpg", pixels, KINDS[kind])
    assert done
    return data.tobytes()


def pixels_at(data: bytes) -> int:
    """Return where the coded pixels of the first scan begin."""
    at = data.index(b"\xff\xda")
    return at + 2 + int.from_bytes(data[at + 2 : at + 4], "big")


@pytest.mark.parametrize("kind", KINDS)
def test_a_whole_jpeg_is_accepted_whatever_its_kind(kind: str, tmp_path: Path) -> None:
    for seed in range(6):
        data = encoded(kind, seed, grey=seed % 2 == 1)
        assert not is_scan_damaged(data)
        (tmp_path / "a.jpg").write_bytes(data + b"\xff\x17 trailing bytes" * seed)
        read_image(tmp_path / "a.jpg", SIZE_PX)
    # A preview has scans of its own, inside a segment; some writers put fill before a marker.
    preview = encoded("plain", 7)
    segment = b"\xff\xe1" + (2 + len(preview)).to_bytes(2, "big") + preview
    data = encoded(kind)
    assert not is_scan_damaged(data[:2] + segment + data[2:-2] + b"\xff\xff" + data[-2:])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("marker", [0x03, 0x55, 0xC0, 0xD8, 0xE5, 0xFE])
def test_a_marker_among_the_pixels_is_refused(kind: str, marker: int, tmp_path: Path) -> None:
    data = bytearray(encoded(kind))
    at = pixels_at(bytes(data)) + 20
    data[at : at + 6] = bytes([0x11, 0xFF, marker, 0x00, 0x09, 0x11])
    (tmp_path / "a.jpg").write_bytes(data)
    with pytest.raises(ImageError, match=r"a\.jpg is damaged among its pixels: bytes there"):
        read_image(tmp_path / "a.jpg", SIZE_PX)


def test_a_restart_that_was_not_announced_is_refused() -> None:
    data = bytearray(encoded("plain"))
    at = pixels_at(bytes(data)) + 20
    data[at : at + 4] = b"\x11\xff\xd3\x11"
    assert is_scan_damaged(bytes(data))
    assert not is_scan_damaged(encoded("restarts"))


def test_a_sector_of_noise_among_the_pixels_is_refused() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 255, (240, 320, 3)).astype(np.uint8)
    whole = cv2.imencode(".jpg", pixels)[1].tobytes()
    count = 0
    for _ in range(100):
        data = bytearray(whole)
        at = int(rng.integers(pixels_at(whole), len(whole) - 5000))
        data[at : at + 4096] = rng.integers(0, 256, 4096).astype(np.uint8).tobytes()
        count += is_scan_damaged(bytes(data))
    assert count >= 95  # noise may begin with a mark of the end


@pytest.mark.parametrize("quality", [30, 75, 95, 100])
def test_a_sector_of_zeros_among_the_pixels_is_refused(quality: int) -> None:
    rng = np.random.default_rng(0)
    pixels = cv2.GaussianBlur(rng.integers(0, 255, (480, 640, 3)).astype(np.uint8), (0, 0), 2)
    options = [cv2.IMWRITE_JPEG_QUALITY, quality]
    data = bytearray(cv2.imencode(".jpg", pixels, options)[1].tobytes())
    assert not is_scan_damaged(bytes(data))
    at = int(rng.integers(pixels_at(bytes(data)), len(data) - 600))
    data[at : at + 512] = bytes(512)
    assert is_scan_damaged(bytes(data))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_image_of_one_color_is_whole(kind: str, level: int) -> None:
    for shape in ((480, 640), (480, 640, 3)):
        pixels = np.full(shape, level, np.uint8)
        pixels[:100, :100] = 90
        assert not is_scan_damaged(cv2.imencode(".jpg", pixels, KINDS[kind])[1].tobytes())


@pytest.mark.extended
def test_recorded_jpegs_are_whole() -> None:
    if not DATA.is_dir():
        pytest.skip("no recordings beside the repository")
    files = sorted(DATA.rglob("*.jpg"))
    assert files
    assert [path for path in files if is_scan_damaged(path.read_bytes())] == []

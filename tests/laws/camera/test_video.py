"""Videos as images of a capture; they are written with OpenCV's own encoder of AVI files."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import SIZE_PX, camera_toml, write_png
from servoid.camera import Picture, video
from servoid.capture import Capture, open_capture
from servoid.errors import CaptureError, ImageError, ServoidError

COUNT = 40


def shade(index: int) -> tuple[int, int, int]:
    """Return the plain colour (RGB) of an image of the video."""
    return 20 + 5 * index, 240 - 5 * index, 40


def write_video(path: Path, count: int = COUNT, size_px: tuple[int, int] = SIZE_PX) -> Path:
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), code, 25.0, size_px)
    for index in range(count):
        writer.write(np.full((size_px[1], size_px[0], 3), shade(index)[::-1], np.uint8))
    writer.release()
    return path


def index_of(image: np.ndarray) -> int:
    """Return which image of the video this is, by its colour."""
    return round((float(image[..., 0].mean()) - 20) / 5)


def open_film(folder: Path, *masked: int, extra: str = "") -> Capture:
    """Open a capture over `film.avi`, with masks of some of its images."""
    (folder / "masks").mkdir(exist_ok=True)
    for index in masked:
        mask = np.zeros(SIZE_PX[::-1], np.uint8)
        mask[index, 5] = 255
        write_png(folder / "masks" / f"{index:04}.png", mask)
    toml = f"version = 1\n{extra}\n{camera_toml(images='film.avi')}"
    toml = toml if masked else toml.replace('masks = "masks/*.png"\n', "")
    (folder / "capture.toml").write_text(toml)
    return open_capture(folder)


def test_a_video_is_as_many_images_as_can_be_decoded(tmp_path: Path) -> None:
    write_video(tmp_path / "film.avi")
    capture = open_film(tmp_path)
    assert len(capture) == COUNT
    views = capture.all_views()
    assert [view.name for view in views[::13]] == ["eye/0000", "eye/0013", "eye/0026", "eye/0039"]
    assert [index_of(view.image()) for view in views] == list(range(COUNT))
    np.testing.assert_allclose(views[7].image().mean(axis=(0, 1)), shade(7), atol=3)


def test_masks_are_those_with_the_number_of_their_image(tmp_path: Path) -> None:
    write_video(tmp_path / "film.avi")
    views = open_film(tmp_path, 3, 38).views()
    assert [view.index for view in views] == [3, 38]
    for view in views:
        assert np.argwhere(view.mask()).tolist() == [[view.index, 5]]
        assert index_of(view.image()) == view.index


def test_images_come_right_in_any_order_and_on_any_thread(tmp_path: Path) -> None:
    path = write_video(tmp_path / "film.avi")
    order = np.random.default_rng(0).permutation(COUNT).tolist()
    assert [index_of(Picture(path, index).read(SIZE_PX)) for index in order] == order
    with ThreadPoolExecutor(max_workers=8) as pool:
        read = pool.map(lambda index: index_of(Picture(path, index).read(SIZE_PX)), range(COUNT))
        assert list(read) == list(range(COUNT))


def test_reading_in_order_decodes_the_video_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_video(tmp_path / "film.avi")
    opened = []
    decode = cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *way: opened.append(way) or decode(*way))
    with ThreadPoolExecutor(max_workers=8) as pool:
        list(pool.map(lambda index: Picture(path, index).read(SIZE_PX), range(0, COUNT, 2)))
    assert len(opened) == 1


def test_a_rate_makes_a_capture_a_recording(tmp_path: Path) -> None:
    write_video(tmp_path / "film.avi")
    assert not open_film(tmp_path).is_recording
    recording = open_film(tmp_path, extra="rate_hz = 20.0")
    assert recording.is_recording
    assert recording.observations()[3].time_s == pytest.approx(0.15)


def test_two_cameras_with_different_numbers_of_images_are_refused(tmp_path: Path) -> None:
    for name, count in (("left", 5), ("right", 4)):
        write_video(tmp_path / f"{name}.avi", count)
    tables = "".join(camera_toml(name, f"{name}.avi") for name in ("left", "right"))
    tables = tables.replace('masks = "masks/*.png"\n', "")
    (tmp_path / "capture.toml").write_text(f"version = 1\n{tables}")
    with pytest.raises(CaptureError, match="'left' has 5 images and camera 'right' has 4"):
        open_capture(tmp_path)


def test_a_pattern_names_one_video(tmp_path: Path) -> None:
    write_video(tmp_path / "film.avi", 2)
    write_video(tmp_path / "other.avi", 2)
    with pytest.raises(CaptureError, match="matches 2 videos"):
        open_film(tmp_path).path.write_text(
            (tmp_path / "capture.toml").read_text().replace("film.avi", "*.avi")
        )
        open_capture(tmp_path)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_a_video_that_is_cut_short_is_refused_or_is_what_can_be_read(
    share: float, tmp_path: Path
) -> None:
    path = write_video(tmp_path / "film.avi")
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(CaptureError, match=r"film\.avi (is cut short|cannot be opened|holds no)"):
        open_film(tmp_path)


@pytest.mark.parametrize(
    "data", [b"\0", b"#EXTM3U\n#EXTINF:1,\n/secret\n", b"\x89PNG\r\n\x1a\n" * 9]
)
def test_what_is_no_video_is_refused_before_a_decoder_sees_it(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "film.avi").write_bytes(data)
    with pytest.raises(CaptureError, match=r"film\.avi is not a video"):
        open_film(tmp_path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write_video(tmp_path_factory.mktemp("whole") / "film.avi", 4, (32, 24)).read_bytes()


@settings(max_examples=60, deadline=None)
@given(
    flips=st.lists(st.tuples(st.integers(0, 600), st.integers(1, 255)), max_size=3),
    end=st.one_of(st.integers(0, 8000), st.just(1 << 20)),
)
def test_a_damaged_video_is_refused_or_has_as_many_images_as_it_says(
    flips: list[tuple[int, int]], end: int, whole: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    data = bytearray(whole[: 1 + end])
    for at, bits in flips:
        data[at % len(data)] ^= bits
    path = tmp_path_factory.getbasetemp() / "damaged.avi"
    path.write_bytes(data)
    try:
        count = video.count_video_images(path)
        for index in range(count):
            assert Picture(path, index).read((32, 24)).shape == (24, 32, 3)
    except ServoidError as error:
        assert str(path) in str(error)


def test_an_image_after_the_end_and_one_of_another_size_are_refused(tmp_path: Path) -> None:
    path = write_video(tmp_path / "film.avi", 3)
    with pytest.raises(ImageError, match=r"film\.avi ends at image 3"):
        Picture(path, 3).read(SIZE_PX)
    assert index_of(Picture(path, 2).read(SIZE_PX)) == 2, "an error leaves the video readable"
    with pytest.raises(ImageError, match=r"160x120 pixels, but its camera has size_px = \[8, 6\]"):
        Picture(path, 0).read((8, 6))
    with pytest.raises(ImageError, match="cannot read"):
        Picture(tmp_path / "none.avi", 0).read(SIZE_PX)


def test_a_video_that_was_written_anew_is_counted_anew(tmp_path: Path) -> None:
    path = write_video(tmp_path / "film.avi", 3)
    assert video.count_video_images(path) == 3
    assert index_of(Picture(path, 2).read(SIZE_PX)) == 2
    write_video(path, 5)
    assert video.count_video_images(path) == 5
    assert index_of(Picture(path, 4).read(SIZE_PX)) == 4

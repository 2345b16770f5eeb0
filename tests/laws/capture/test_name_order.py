"""Names of images: their order as text and by number, and names that count twice."""

from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from conftest import camera_toml, write_png
from servoid.capture import open_capture, order_note
from servoid.errors import CaptureError
from servoid.opening import GivenCalibration, open_recorded, parse_source


def noted(names: list[str]) -> str | None:
    return order_note(sorted(Path("images") / name for name in names), "the images")


def write_images(folder: Path, names: list[str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        write_png(folder / name, np.zeros((120, 160, 3), np.uint8))
    return folder


@given(st.lists(st.integers(0, 2000), min_size=1, unique=True))
def test_an_order_is_noted_where_numbers_and_texts_disagree(numbers: list[int]) -> None:
    is_other = sorted(numbers) != sorted(numbers, key=lambda number: f"img{number}.jpg")
    assert (noted([f"img{number}.jpg" for number in numbers]) is not None) == is_other
    assert noted([f"img{number:04}.jpg" for number in numbers]) is None


def test_the_note_on_an_order_names_files_and_how_to_pad_them() -> None:
    note = noted(["img1.jpg", "img2.jpg", "img10.jpg", "img100.jpg"])
    assert note is not None
    assert "img100.jpg comes before img2.jpg" in note
    assert "such as img002.jpg" in note


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["10_rgb_0.png", "2_rgb_0.png"], "10_rgb_0.png comes before 2_rgb_0.png"),
        (["10_rgb_0.png", "2_rgb_0.png"], "such as 02_rgb_0.png, "),
        (["cam0_7.5.jpg", "cam0_10.25.jpg"], "such as cam0_07.5.jpg, "),
        (["frame.10", "frame.9"], "such as frame.09, "),
        (["seq10/image.png", "seq2/image.png"], "such as seq02, "),
        (["seq10/1.png", "seq10/2.png", "seq2/1.png"], "seq10 comes before seq2;"),
        (["img9.png", "img10.png", "reference.png"], "such as img09.png, "),
    ],
)
def test_the_number_that_is_out_of_order_is_padded(names: list[str], told: str) -> None:
    assert told in (noted(names) or "")


@given(st.randoms(use_true_random=False), st.integers(2, 300), st.sampled_from([4, 6, 8, 16, 32]))
def test_digests_are_not_noted(random: Random, count: int, digits: int) -> None:
    names = [f"{random.getrandbits(4 * digits):0{digits}x}.png" for _ in range(count)]
    assert noted(list(set(names))) is None


@pytest.mark.parametrize(
    "names",
    [
        ["2024-01-02 12.5.30.png", "2024-01-02 12.10.31.png"],  # numbers of several kinds
        ["1305031102.1753.png", "1305031102.2.png", "1305031103.png"],  # fractions of seconds
        ["a3f9.jpg", "a12b.jpg", "9c.jpg"],  # hashes
        ["left.jpg", "right.jpg"],
        ["9.jpg"],
        [],
    ],
)
def test_names_whose_numbers_do_not_count_them_are_not_noted(names: list[str]) -> None:
    assert noted(names) is None


def test_a_capture_and_a_folder_of_images_note_the_order_of_their_names(tmp_path: Path) -> None:
    for name in ("left", "right"):
        write_images(tmp_path / name, ["img1.png", "img2.png", "img10.png"])
    cameras = [camera_toml(name, f"{name}/*.png", f"{name}/*.png") for name in ("left", "right")]
    (tmp_path / "capture.toml").write_text("\n".join(["version = 1", "rate_hz = 30", *cameras]))
    (note,) = open_capture(tmp_path).notes
    assert note.startswith("the images of cameras 'left' and 'right' are used in the order of")
    notes = open_recorded(
        parse_source(str(tmp_path / "left")), GivenCalibration(fov_deg=60.0, rate_hz=30.0)
    ).notes
    assert any("img10.png comes before img2.png" in one for one in notes)


def test_two_files_of_one_name_are_not_two_images(tmp_path: Path) -> None:
    folder = write_images(tmp_path / "left", ["1.png", "2.png"])
    (folder / "2.jpg").write_bytes((folder / "2.png").read_bytes())
    toml = camera_toml("left", "left/*", "left/*.png")
    (tmp_path / "capture.toml").write_text(f"version = 1\n{toml}")
    with pytest.raises(CaptureError, match=r"2\.jpg and 2\.png have the same name"):
        open_capture(tmp_path)
    with pytest.raises(CaptureError, match=r"2\.jpg and 2\.png have the same name"):
        open_recorded(parse_source(str(folder)), GivenCalibration(fov_deg=60.0))
    (folder / "2.jpg").rename(folder / "3.jpg")
    assert len(open_capture(tmp_path)) == 3


def test_names_that_number_images_behind_the_dot_are_images_of_their_own(tmp_path: Path) -> None:
    write_images(tmp_path / "left", ["1.png", "2.png", "3.png"])
    for index in range(3):
        (tmp_path / "left" / f"{index + 1}.png").rename(tmp_path / "left" / f"frame.{index:04}")
    toml = camera_toml("left", "left/frame.*", "left/*.png").replace('masks = "left/*.png"\n', "")
    (tmp_path / "capture.toml").write_text(f"version = 1\n{toml}")
    assert len(open_capture(tmp_path)) == 3


def test_a_pattern_that_matches_nothing_is_corrected_by_one_that_is_allowed(tmp_path: Path) -> None:
    write_images(tmp_path / "left", ["1.png"])
    for images, masks, example in (
        ("left/*.jpg", "left/*.png", "images/*.jpg"),
        ("left/*.png", "left/m*.png", "masks/*.png"),
    ):
        toml = camera_toml("left", images, masks)
        (tmp_path / "capture.toml").write_text(f"version = 1\n{toml}")
        with pytest.raises(CaptureError) as caught:
            open_capture(tmp_path)
        assert str(caught.value).endswith(f"correct the pattern, such as '{example}'")

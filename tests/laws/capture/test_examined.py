"""What a few images of a capture tell: how many bits their values have, and pages."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import BACKGROUND, Drawing
from servoid.camera import describe_video, largest_value, likely_bits, read_image_size
from servoid.capture import Capture, open_capture
from servoid.errors import CaptureError, ImageError
from servoid.model import find_in_view
from servoid.opening import GivenCalibration, open_recorded, parse_source
from servoid.scan.footage import open_footage
from servoid.scan.staging import stage
from servoid.segment import BackgroundTarget
from servoid.source import read_instants, tidy_image

LOW_BITS = [8, 10, 12]


def deepened(folder: Path, bits: int, suffix: str = ".png") -> Capture:
    """Store the images of a capture in 16 bits, of which `bits` are used."""
    for path in (folder / "images").glob("*.png"):
        pixels = cv2.imread(str(path)).astype(np.uint16)
        path.unlink()
        assert cv2.imwrite(str(path.with_suffix(suffix)), pixels << (bits - 8))
    toml = (folder / "capture.toml").read_text()
    (folder / "capture.toml").write_text(toml.replace("images/*.png", f"images/*{suffix}"))
    return open_capture(folder)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("bits", [*LOW_BITS, 16])
def test_images_of_any_bits_are_as_bright_as_in_8(
    drawn_capture: Path, bits: int, suffix: str
) -> None:
    before = [view.recorded_image() for view in open_capture(drawn_capture).all_views()]
    capture = deepened(drawn_capture, bits, suffix)
    for view, image in zip(capture.all_views(), before, strict=True):
        off = 1 if (bits, suffix) == (16, ".tif") else 0  # there, the decoder itself rounds
        np.testing.assert_allclose(view.recorded_image().astype(int), image, atol=off)
        half = view.picture.read((160, 120), 2)
        assert half.shape == (60, 80, 3)
        assert float(half.mean()) == pytest.approx(float(image.mean()), abs=1.0)
    if bits == 16:
        assert capture.notes == ()
    else:
        (note,) = capture.notes
        assert f"all are taken as {bits}-bit values" in note


def test_all_images_of_a_capture_are_read_with_the_same_bits(drawn_capture: Path) -> None:
    capture = deepened(drawn_capture, 12)
    path = sorted((drawn_capture / "images").iterdir())[1]
    values = np.full((120, 160, 3), 256, np.uint16)
    assert cv2.imwrite(str(path), values)  # a dark one
    bits = {one.bits for one in open_capture(drawn_capture).cameras[0].pictures if one is not None}
    assert bits == {12} == {one.bits for one in capture.cameras[0].pictures if one is not None}
    assert open_capture(drawn_capture).all_views()[1].recorded_image().max() == 16


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("largest", [1 << 12, 30_000, 65_535])
def test_an_image_that_exceeds_the_bits_of_its_capture_is_an_error_of_its_own(
    drawn_capture: Path, largest: int, suffix: str
) -> None:
    deepened(drawn_capture, 12, suffix)
    path = sorted((drawn_capture / "images").iterdir())[2]  # none of those that are looked at
    values = np.full((120, 160, 3), 3000, np.uint16)
    values[5, 7] = largest
    assert cv2.imwrite(str(path), values)
    capture = open_capture(drawn_capture)
    views = capture.all_views()
    with pytest.raises(
        ImageError, match=rf"{path.stem}\{suffix} has the value {largest}, .* in 8 bits"
    ):
        views[2].recorded_image()
    assert views[0].recorded_image().max() <= 255
    instants = list(read_instants(capture, capture.observations()))
    assert [one.images[0] is None for one in instants] == [
        place == 2 for place in range(len(views))
    ]
    assert any(f"has the value {largest}" in notice for notice in instants[2].notices)


def test_a_background_is_read_with_the_bits_of_the_capture(
    drawn_capture: Path, tmp_path: Path
) -> None:
    view = deepened(drawn_capture, 12).all_views()[0]
    empty = np.full((120, 160, 3), BACKGROUND, np.uint16)
    found = []
    for name, values in (("8.png", empty.astype(np.uint8)), ("12.png", empty << 4)):
        assert cv2.imwrite(str(tmp_path / name), values)
        target = BackgroundTarget(tmp_path / name)
        found.append(find_in_view(target, view, view.recorded_image(), [view]).mask)
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("kept", [0, 100])
def test_damaged_images_tell_nothing_about_the_bits(drawn_capture: Path, kept: int) -> None:
    deepened(drawn_capture, 12)
    first = min((drawn_capture / "images").iterdir())
    first.write_bytes(first.read_bytes()[:kept])
    capture = open_capture(drawn_capture)
    assert {one.bits for one in capture.cameras[0].pictures if one is not None} == {12}


def test_black_images_are_of_any_bits(tmp_path: Path, drawing: Drawing) -> None:
    folder = drawing.write(tmp_path)
    for path in (folder / "images").iterdir():
        assert cv2.imwrite(str(path), np.zeros((120, 160, 3), np.uint16))
    assert open_capture(folder).notes == ()


def test_photographs_of_12_bits_are_as_bright_as_in_8_and_a_scan_refuses_them(
    drawn_capture: Path, tmp_path: Path
) -> None:
    before = open_capture(drawn_capture).all_views()[0].recorded_image()
    deepened(drawn_capture, 12)
    images = drawn_capture / "images"
    opened = open_recorded(parse_source(str(images)), GivenCalibration(fov_deg=50.0))
    np.testing.assert_array_equal(opened.capture.all_views()[0].recorded_image(), before)
    assert "taken as 12-bit values" in opened.capture.notes[0]
    paths = sorted(images.iterdir())
    assert largest_value(paths[0]) is not None
    footage = open_footage(images)
    with pytest.raises(ImageError, match=r"of a camera with 12 bits: .*multiply its values by 16"):
        stage(footage, [path.stem for path in paths], tmp_path)


@pytest.mark.parametrize("bits", LOW_BITS)
def test_an_array_of_fewer_bits_has_a_notice(bits: int) -> None:
    image: NDArray[np.uint16] = np.full((4, 6), (1 << bits) - 1, np.uint16)
    pixels, notice = tidy_image(image)
    assert pixels is not None
    assert notice is not None
    assert f"as of a camera with {bits} bits" in notice
    assert tidy_image(image << (16 - bits))[1] is None
    assert tidy_image(np.zeros_like(image))[1] is None


@pytest.mark.parametrize("largest", [0, 1, 255, 256, 1023, 1024, 4095, 4096, 65535])
def test_the_fewest_bits_that_hold_a_value_are_likely(largest: int) -> None:
    assert likely_bits(largest) == min(one for one in (8, 10, 12, 16) if largest < 1 << one)


@pytest.mark.parametrize(("pages", "suffix"), [(1, ".tif"), (2, ".tif"), (3, ".tiff")])
def test_images_with_several_pages_are_noted(drawn_capture: Path, pages: int, suffix: str) -> None:
    for path in (drawn_capture / "images").glob("*.png"):
        page = cv2.imread(str(path))
        path.unlink()
        assert cv2.imwritemulti(str(path.with_suffix(suffix)), [page] * pages)
    toml = (drawn_capture / "capture.toml").read_text().replace("images/*.png", f"images/*{suffix}")
    (drawn_capture / "capture.toml").write_text(toml)
    images = drawn_capture / "images"
    opened = open_recorded(parse_source(str(images)), GivenCalibration(fov_deg=50.0))
    for notes in (open_capture(drawn_capture).notes, opened.capture.notes):
        assert len(notes) == (pages > 1)
        assert all(f"has {pages} pages, and so may others" in note for note in notes)


@pytest.mark.parametrize("name", ["image.png", "image.mp4"])
def test_an_empty_file_is_called_empty(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"")
    with pytest.raises((ImageError, CaptureError), match=f"{name} is empty; replace the file"):
        describe_video(path) if name.endswith(".mp4") else read_image_size(path)

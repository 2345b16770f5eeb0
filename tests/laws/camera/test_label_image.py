"""Masks whose values stand for several objects, and masks of one object that look like them."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.camera import read_mask
from servoid.capture import open_capture
from servoid.errors import MaskError
from servoid.segment import MaskTarget, find_object

SIZE_PX = (160, 120)


def two_areas(first: int, second: int, background: int = 0) -> NDArray[np.uint8]:
    mask = np.full((120, 160), background, np.uint8)
    mask[20:80, 20:70] = first
    mask[40:100, 90:140] = second
    return mask


def one_area(value: int = 255) -> NDArray[np.uint8]:
    mask = np.zeros((120, 160), np.uint8)
    return np.asarray(cv2.ellipse(mask, (80, 60), (50, 30), 20, 0, 360, value, -1), np.uint8)


def written(folder: Path, mask: "cv2.typing.MatLike", name: str = "mask.png") -> Path:
    assert cv2.imwrite(str(folder / name), mask)
    return folder / name


@pytest.mark.parametrize(
    ("mask", "words"),
    [
        (two_areas(1, 2), "has areas with the values 1 and 2: which one is the object? Write"),
        (two_areas(2, 2, background=1), "has areas with the values 1 and 2: which"),
        (two_areas(7, 41), "has areas with the values 7 and 41: which"),
    ],
)
def test_a_mask_with_a_value_for_each_of_several_objects_is_refused_with_its_values(
    tmp_path: Path, mask: NDArray[np.uint8], words: str
) -> None:
    path = written(tmp_path, mask)
    with pytest.raises(MaskError, match=re.escape(words)):
        read_mask(path, SIZE_PX)
    image = np.full((120, 160, 3), 90, np.uint8)
    with pytest.raises(MaskError, match="which one is the object"):
        find_object(MaskTarget(path), image)


def test_labels_of_sixteen_bits_are_refused_too(tmp_path: Path) -> None:
    path = written(tmp_path, two_areas(1, 2).astype(np.uint16))
    with pytest.raises(MaskError, match="the values 1 and 2"):
        read_mask(path, SIZE_PX)


@pytest.mark.parametrize("times", [3, 8])
def test_a_soft_border_of_large_steps_is_no_label(times: int, tmp_path: Path) -> None:
    small = cv2.resize(one_area(), None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    large = cv2.resize(small, None, fx=times, fy=times, interpolation=cv2.INTER_NEAREST)
    mask = large // 64 * 64
    assert read_mask(written(tmp_path, mask), (mask.shape[1], mask.shape[0])).any()
    assert read_mask(written(tmp_path, two_areas(254, 255)), SIZE_PX).any()


def test_a_view_of_a_capture_refuses_labels_as_its_mask(drawn_capture: Path) -> None:
    view = open_capture(drawn_capture).views()[0]
    assert view.mask_path is not None
    mask = cv2.imread(str(view.mask_path), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    labels = (mask != 0).astype(np.uint8)
    labels[:20, :20] = 2
    cv2.imwrite(str(view.mask_path), labels)
    with pytest.raises(MaskError, match="the values 1 and 2"):
        view.mask()


@pytest.mark.parametrize("value", [1, 127, 255])
def test_a_mask_of_one_value_is_accepted(tmp_path: Path, value: int) -> None:
    mask = one_area(value)
    assert ((read_mask(written(tmp_path, mask), SIZE_PX) != 0) == (mask != 0)).all()


@pytest.mark.parametrize("quality", [30, 75, 95, 100])
def test_the_grey_border_of_a_compressed_mask_is_no_label(tmp_path: Path, quality: int) -> None:
    data = cv2.imencode(".jpg", one_area(), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    (tmp_path / "mask.jpg").write_bytes(data.tobytes())
    assert read_mask(tmp_path / "mask.jpg", SIZE_PX).any()


@pytest.mark.parametrize("smoothing_px", [0.6, 2.0, 8.0])
def test_a_smoothed_border_is_no_label(tmp_path: Path, smoothing_px: float) -> None:
    mask = cv2.GaussianBlur(one_area(), (0, 0), smoothing_px)
    assert read_mask(written(tmp_path, mask), SIZE_PX).any()


def test_an_object_cut_out_of_its_photograph_is_no_image_of_labels(tmp_path: Path) -> None:
    photograph = np.random.default_rng(0).integers(1, 255, (120, 160, 3)).astype(np.uint8)
    photograph[50:60, 60:80] = 255  # two areas of one colour each
    photograph[65:75, 60:80] = 9
    photograph[one_area() == 0] = 0
    assert read_mask(written(tmp_path, photograph), SIZE_PX).any()

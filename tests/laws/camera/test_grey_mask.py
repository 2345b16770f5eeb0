"""Masks that hold probabilities, and what is no sign of them."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import Drawing
from servoid.camera import grey_note, grey_share, read_image
from servoid.capture import open_capture
from servoid.model.marking import mark
from servoid.segment import MaskTarget, find_with_doubts

Mask = NDArray[np.uint8]


def disk(radius_px: float = 60.0) -> Mask:
    v, u = np.mgrid[:240, :320]
    return np.where(np.hypot(u - 150, v - 110) < radius_px, 255, 0).astype(np.uint8)


def as_jpeg(quality: int) -> Callable[[Mask], Mask]:
    def change(mask: Mask) -> Mask:
        stored = cv2.imencode(".jpg", mask, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        return np.asarray(cv2.imdecode(stored, cv2.IMREAD_GRAYSCALE), np.uint8)

    return change


def blurred(sigma_px: float) -> Callable[[Mask], Mask]:
    return lambda mask: np.asarray(cv2.GaussianBlur(mask, (0, 0), sigma_px), np.uint8)


def enlarged(mask: Mask) -> Mask:
    small = cv2.resize(mask, (40, 30), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.resize(small, (320, 240), interpolation=cv2.INTER_CUBIC), np.uint8)


def share(folder: Path, mask: NDArray[np.uint8 | np.uint16]) -> float:
    assert cv2.imwrite(str(folder / "mask.png"), mask)
    return grey_share(folder / "mask.png")


def label(mask: Mask) -> Mask:
    return np.maximum(mask // 2, disk(15.0))


def on_black(mask: Mask) -> Mask:
    """Return a picture of a dark object with texture and a highlight, black around it."""
    noise = np.random.default_rng(1).normal(90.0, 300.0, mask.shape).astype(np.float32)
    seen = np.clip(np.asarray(cv2.GaussianBlur(noise, (0, 0), 2.0)), 1.0, 120.0)
    seen[100:110, 140:150] = 255.0
    return np.where(mask > 0, seen, 0.0).astype(np.uint8)


HARMLESS: dict[str, Callable[[Mask], NDArray[np.uint8 | np.uint16]]] = {
    "255": lambda mask: mask,
    "1": lambda mask: mask // 255,
    "100": lambda mask: mask // 255 * np.uint8(100),
    "16 bits": lambda mask: mask.astype(np.uint16) * 257,
    "colours": lambda mask: np.dstack([mask // 7, mask, mask // 3]),
    "jpeg 50": as_jpeg(50),
    "jpeg 90": as_jpeg(90),
    "smooth border": blurred(0.5),
    "nothing": np.zeros_like,
    "two labels": label,
    "picture": on_black,
    "picture of 16 bits": lambda mask: on_black(mask).astype(np.uint16) * 257,
}
GREY: dict[str, Callable[[Mask], NDArray[np.uint8 | np.uint16]]] = {
    "blurred": blurred(4.0),
    "enlarged": enlarged,
    "probability below a half": lambda mask: blurred(4.0)(mask) // 2,
    "16 bits": lambda mask: blurred(4.0)(mask).astype(np.uint16) * 257,
    "colours": lambda mask: np.dstack([blurred(4.0)(mask)] * 3),
}


@pytest.mark.parametrize("name", HARMLESS)
def test_masks_without_probabilities_are_not_noted(tmp_path: Path, name: str) -> None:
    assert grey_note(share(tmp_path, HARMLESS[name](disk()))) is None


@pytest.mark.parametrize("axes_px", [(4, 4), (6, 6), (10, 10), (60, 5), (60, 2), (120, 10)])
@pytest.mark.parametrize("sigma_px", [0.0, 0.5, 0.8])
def test_smooth_borders_are_not_noted_however_small_or_slender_the_object_is(
    tmp_path: Path, axes_px: tuple[int, int], sigma_px: float
) -> None:
    mask = np.zeros((240, 320), np.uint8)
    cv2.ellipse(mask, (160, 120), axes_px, 20, 0, 360, (255,), -1, cv2.LINE_AA)
    assert grey_note(share(tmp_path, blurred(sigma_px)(mask) if sigma_px else mask)) is None


@pytest.mark.parametrize("radius_px", [6.0, 10.0, 40.0, 100.0])
def test_wide_borders_are_noted_whatever_the_size_of_the_object(
    tmp_path: Path, radius_px: float
) -> None:
    assert grey_note(share(tmp_path, blurred(3.0)(disk(radius_px)))) is not None


@pytest.mark.parametrize("name", GREY)
def test_masks_of_probabilities_are_noted(tmp_path: Path, name: str) -> None:
    note = grey_note(share(tmp_path, GREY[name](disk())))
    assert note is not None
    assert "threshold the mask at a half" in note


def test_the_grey_share_is_what_a_threshold_removes(tmp_path: Path) -> None:
    mask = blurred(6.0)(disk())
    mask[mask <= 8] = 0
    removed = 1.0 - float((mask > 128).sum()) / float((mask > 0).sum())
    assert share(tmp_path, mask) == pytest.approx(removed)


@pytest.mark.filterwarnings("error")
def test_a_mask_without_an_outside_has_no_border(tmp_path: Path) -> None:
    # An even number of grey pixels, whose median is the mean of two distances.
    everywhere = np.tile(np.arange(20, 220, dtype=np.uint8).reshape(10, 20), (2, 1))
    assert share(tmp_path, everywhere) == 0.0


def test_grey_masks_of_a_capture_and_of_a_target_are_in_doubt(
    tmp_path: Path, drawing: Drawing
) -> None:
    capture = open_capture(drawing.write(tmp_path))
    assert not any("grey" in doubt for doubt in mark(capture).doubts)
    paths = [view.mask_path for view in capture.views() if view.mask_path is not None]
    for path in paths:
        mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(path), blurred(4.0)(np.asarray(mask, np.uint8)))
    (doubt,) = (doubt for doubt in mark(capture).doubts if "grey" in doubt)
    assert doubt.startswith("the mask of eye/")
    view = capture.views()[0]
    image = read_image(view.image_path, view.lens.size_px)
    (note,) = find_with_doubts(MaskTarget(paths[0]), image).notes
    assert "threshold the mask at a half" in note

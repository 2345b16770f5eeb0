"""The border of a mask lies on the edges of its own image, and hardly anywhere else."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from drawn_pairs import Pair
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from servoid.segment.borders import border_rank, fitting_shift

Image = NDArray[np.uint8]
LEAST = 0.8  # of the ranks of right masks


def drawn(seed: int) -> tuple[Image, Image]:
    """Return the image and the mask of an ellipsoid, with or without a pattern."""
    random = np.random.default_rng(seed)
    center = (0.012 + random.uniform(-0.03, 0.03), -0.008, random.uniform(0.35, 0.6))
    image, _, inside = Pair(centers=(center,), patterned=seed % 2 == 0).draw(0, 0.0)
    return image, inside.astype(np.uint8) * np.uint8(255)


def noisy(image: Image) -> Image:
    noise = np.random.default_rng(0).normal(0.0, 15.0, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


CHANGES: dict[str, Callable[[Image], Image]] = {
    "as it is": lambda image: image,
    "noise": noisy,
    "dark": lambda image: image // 5,
    "grey": lambda image: np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8),
}


@pytest.mark.parametrize("change", CHANGES)
def test_nowhere_around_its_object_does_a_mask_fit_its_image_as_well(change: str) -> None:
    for seed in range(6):
        image, mask = drawn(seed)
        rank = border_rank(CHANGES[change](image), mask)
        assert rank is not None and rank > LEAST


@pytest.mark.parametrize("drawn_px", [-2, 2])
def test_a_border_that_is_drawn_by_hand_still_fits(drawn_px: int) -> None:
    for seed in range(6):
        image, mask = drawn(seed)
        kernel = np.ones((2 * abs(drawn_px) + 1,) * 2, np.uint8)
        change = cv2.dilate if drawn_px > 0 else cv2.erode
        rank = border_rank(image, np.asarray(change(mask, kernel), np.uint8))
        assert rank is not None and rank > LEAST


def test_a_mask_beside_its_object_or_much_wider_fits_worse() -> None:
    for seed in range(6):
        image, mask = drawn(seed)
        side = round(0.3 * np.sqrt((mask != 0).sum()))
        wide = np.asarray(cv2.dilate(mask, np.ones((side, side), np.uint8)), np.uint8)
        for wrong in (np.roll(mask, side, axis=1), np.roll(mask, -side, axis=0), wide):
            right, rank = border_rank(image, mask), border_rank(image, wrong)
            assert right is not None and rank is not None and rank < right


def test_a_displaced_mask_is_moved_back_by_as_much() -> None:
    for seed in range(6):
        image, mask = drawn(seed)
        size = np.sqrt((mask != 0).sum())
        x, y = round(0.2 * size), round(-0.1 * size)
        found = fitting_shift(image, np.roll(mask, (y, x), axis=(0, 1)))
        assert found is not None and abs(found[2] - size) < 1e-6 * size
        assert max(abs(found[0] + x), abs(found[1] + y)) < 0.04 * size


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 5), st.integers(-20, 20))
def test_an_image_and_its_mask_that_are_mirrored_fit_as_before(seed: int, shift: int) -> None:
    image, mask = drawn(seed)
    mask = np.roll(mask, shift, axis=1)
    there = border_rank(image[:, ::-1].copy(), mask[:, ::-1].copy())
    here = border_rank(image, mask)
    assert here is not None and there is not None
    assert abs(here - there) < 0.13  # two of sixteen: displacements are rounded to pixels


def test_where_nothing_is_to_be_seen_nothing_is_said() -> None:
    image, mask = drawn(0)
    speck = np.zeros_like(mask)
    speck[50:55, 60:65] = 255
    for nothing in (border_rank(np.full_like(image, 90), mask), border_rank(image, speck)):
        assert nothing is None
    for nothing in (np.zeros_like(mask), np.full_like(mask, 255)):
        assert border_rank(image, nothing) is None and fitting_shift(image, nothing) is None

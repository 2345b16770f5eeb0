"""Masks of other images, or beside their objects, are told by the edges of the images."""

from collections.abc import Callable, Sequence

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from toys import seen, toy

from servoid.capture import View
from servoid.model import fit

Image = NDArray[np.uint8]
COUNT, SIDE_PX = 8, 12  # of the checks of a background


def photographs(seed: int, count: int = COUNT) -> tuple[list[View], list[Image]]:
    """Return views of a toy from all around, and images of it before a chequered background."""
    views = seen(toy(seed))
    views = views[:: max(1, len(views) // count)][:count]
    random = np.random.default_rng(seed)
    images = []
    for view in views:
        height, width = view.mask.shape
        checks = random.integers(40, 120, (height // SIDE_PX + 1, width // SIDE_PX + 1, 3))
        image = np.kron(checks, np.ones((SIDE_PX, SIDE_PX, 1)))[:height, :width]
        image[view.mask != 0] = (210, 180, 60)
        image = cv2.GaussianBlur(image, (0, 0), 1.0) + random.normal(0.0, 4.0, image.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
    return list(views), images


def doubts_of(views: Sequence[View], images: Sequence[Image]) -> tuple[str, str]:
    """Return the verdict of a small body, and what is said of borders."""
    made = fit(views, images=[np.ascontiguousarray(image) for image in images], max_ellipsoids=3)
    return made.verdict.word, " ".join(one for one in made.all_doubts if "border" in one)


FAULTS: dict[str, tuple[Callable[[list[Image]], list[Image]], str]] = {
    "next": (lambda some: [*some[1:], some[0]], "each has the image of the one before"),
    "previous": (lambda some: [some[-1], *some[:-1]], "each has the image of the next one"),
    "mirrored": (lambda some: [one[:, ::-1] for one in some], "the images are mirrored"),
    "rotated": (lambda some: [one[::-1, ::-1] for one in some], "are rotated by 180 degrees"),
}


@pytest.mark.parametrize("seed", range(3))
def test_masks_of_their_own_images_are_not_doubted(seed: int) -> None:
    assert doubts_of(*photographs(seed))[1] == ""


@pytest.mark.parametrize("fault", FAULTS)
def test_masks_of_other_images_are_doubted_and_what_would_fit_is_named(fault: str) -> None:
    views, images = photographs(0)
    change, named = FAULTS[fault]
    word, said = doubts_of(views, change(images))
    assert word != "good" and named in said


def test_masks_that_are_all_beside_the_object_are_told_with_the_way_back() -> None:
    views, images = photographs(1)
    _, said = doubts_of(views, [np.roll(image, (10, -18), axis=(0, 1)) for image in images])
    x, y = (int(one) for one in said.split("moved by (")[1].split(")")[0].split(","))
    # They are sought in steps of 3 % of the object's size, 90 px.
    assert abs(x + 18) <= 5 and abs(y - 10) <= 5


@pytest.mark.extended
def test_among_many_views_the_neighbour_whose_image_fits_is_named_as_well() -> None:
    views, images = photographs(0, count=40)
    _, said = doubts_of(views, [*images[1:], images[0]])
    assert "each has the image of the one before" in said


def test_two_exchanged_images_among_right_ones_are_named() -> None:
    views, images = photographs(2)
    word, said = doubts_of(views, [images[0], images[3], images[2], images[1], *images[4:]])
    assert word != "good" and "in 2 of 8 views, such as view/" in said

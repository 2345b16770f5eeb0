"""Views of an object that was moved between two series are told, and right ones are not blamed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from textured import photographs
from true_captures import TRUE_CAPTURES, true_capture

from servoid.capture import CaptureView, View, views_of
from servoid.model import fit
from servoid.model.contradicting_views import Contradiction, contradicting_views
from servoid.model.view_features import look, place
from servoid.pose import Pose

COUNT = 24
Photographs = tuple[list[View], list[NDArray[np.uint8]]]

MOTIONS: dict[str, Sequence[float]] = {
    "turned upright": (0.0, 0.0, 0.0, 0.0, 0.0, np.radians(20.0)),
    "tilted": (0.0, 0.0, 0.0, 0.0, np.radians(10.0), 0.0),
    "displaced": (0.02, 0.0, 0.0, 0.0, 0.0, 0.0),
}
CHOICES: dict[str, Callable[[int], bool]] = {
    "the second half": lambda at: at >= COUNT // 2,
    "every third": lambda at: at % 3 == 0,
}


@cache
def drawn() -> Photographs:
    made = photographs(COUNT)
    return [view for view, _ in made], [image for _, image in made]


def moved(motion: Sequence[float], chosen: Callable[[int], bool]) -> list[View]:
    """Return views of which those `chosen` have poses of the object elsewhere."""
    off = Pose.exp(motion)
    return [
        View(
            camera=view.camera,
            world_from_camera=off @ view.world_from_camera
            if chosen(at)
            else view.world_from_camera,
            mask=view.mask,
        )
        for at, view in enumerate(drawn()[0])
    ]


def compared(
    views: Sequence[View], images: Sequence[NDArray[np.uint8]] | None = None
) -> Contradiction | None:
    return contradicting_views(views_of(views, drawn()[1] if images is None else images))


def recorded(name: str, motion: Sequence[float]) -> list[CaptureView]:
    """Return photographs, the second half of which have poses of an object that was moved."""
    views = true_capture(name).views()
    center = place([one for one in map(look, views[::4]) if one is not None])
    there = Pose.from_parts(center, (1.0, 0.0, 0.0, 0.0))
    off = there @ Pose.exp(motion) @ there.inverse()
    first, second = views[: len(views) // 2], views[len(views) // 2 :]
    return [*first, *(replace(view, world_from_lens=off @ view.world_from_lens) for view in second)]


def test_right_views_before_a_background_that_does_not_turn_with_the_object_are_not_blamed() -> (
    None
):
    assert compared(drawn()[0]) is None


@pytest.mark.parametrize("motion", MOTIONS)
def test_views_before_and_after_the_object_was_moved_are_told_apart(motion: str) -> None:
    found = compared(moved(MOTIONS[motion], CHOICES["the second half"]))
    assert found is not None and found.is_apart
    assert "the views view/0 to view/11 and the views view/12 to view/23 fit" in found.words


def test_views_of_two_reconstructions_in_turns_are_told_apart() -> None:
    found = compared(moved(MOTIONS["tilted"], CHOICES["every third"]))
    assert found is not None and found.is_apart
    assert "8 views such as view/0, view/3 and view/6 and 16 views such as" in found.words


def test_poses_that_are_all_wrong_are_told_and_no_part_is_named() -> None:
    random = np.random.default_rng(0)
    off = [
        Pose.exp([*random.normal(0.0, 0.01, 3), *random.normal(0.0, 0.05, 3)]) for _ in range(COUNT)
    ]
    wrong = [
        View(camera=view.camera, world_from_camera=view.world_from_camera @ by, mask=view.mask)
        for view, by in zip(drawn()[0], off, strict=True)
    ]
    found = compared(wrong)
    assert found is not None and not found.is_apart


def test_an_object_without_features_says_nothing_whatever_is_around_it() -> None:
    views, images = drawn()
    flat = [
        np.where(view.mask[..., None] != 0, np.uint8(120), image)
        for view, image in zip(views, images, strict=True)
    ]
    assert compared(moved(MOTIONS["displaced"], CHOICES["the second half"]), flat) is None


def test_a_body_of_views_that_contradict_each_other_is_not_good() -> None:
    few = {"max_ellipsoids": 1, "delta": 0.0, "seed": 0}
    right = fit(drawn()[0], images=drawn()[1], **few)
    wrong = fit(
        moved(MOTIONS["turned upright"], CHOICES["the second half"]), images=drawn()[1], **few
    )
    assert right.verdict.word == "good"
    assert wrong.verdict.word != "good" and wrong.verdict.is_doubted
    assert [one for one in wrong.doubts if "exchanged" in one] == []


@pytest.mark.extended
@pytest.mark.parametrize("name", [name for name in TRUE_CAPTURES if name.startswith("photos/")])
def test_recorded_photographs_are_not_blamed_and_moved_ones_are(name: str) -> None:
    assert contradicting_views(true_capture(name).views()) is None
    for degrees in (15.0, 30.0):
        found = contradicting_views(recorded(name, [0.0, 0.0, 0.0, 0.0, 0.0, np.radians(degrees)]))
        assert found is not None


@pytest.mark.extended
@pytest.mark.parametrize("motion", MOTIONS)
def test_recorded_photographs_before_and_after_the_object_was_moved_are_told_apart(
    motion: str,
) -> None:
    found = contradicting_views(recorded("photos/skull", MOTIONS[motion]))
    assert found is not None and found.is_apart
    assert "eye/0000 to eye/0023" in found.words

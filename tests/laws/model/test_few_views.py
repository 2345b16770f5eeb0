"""A few views are fitted well by a wrong body too: it is not called good unless they agree."""

import contextlib
import re
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from tiers import tiered
from toys import CAMERA, roughened, seen, toy

from servoid.capture import View
from servoid.errors import ModelError
from servoid.model import ModelResult, fit
from servoid.model.left_out import directions
from servoid.pose import Pose

Fault = Callable[[Sequence[Pose]], list[Pose]]
CV_FROM_GL = Pose.from_parts((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
EYES_M = 0.05
FAULTS: dict[str, Fault] = {
    "inverted": lambda poses: [pose.inverse() for pose in poses],
    "y up": lambda poses: [pose @ CV_FROM_GL for pose in poses],
    "two exchanged": lambda poses: [poses[1], poses[0], *poses[2:]],
    "one line early": lambda poses: [*poses[1:], poses[0]],
    "reversed": lambda poses: list(poses)[::-1],
}
NAMED = {
    "inverted": "camera_from_world: invert them; then a body of all others overlaps",
    "y up": "as in OpenGL .*; then a body of all others overlaps",
    "two exchanged": "view/[01] and view/[01] look exchanged: each with the other's pose, a body",
    "one line early": "takes the pose of the line before, a body of all others overlaps",
    "reversed": "poses are taken in reversed order, a body of all others overlaps",
}


def few(count: int, seed: int) -> list[View]:
    """Return views from all around, with rough masks and poses."""
    views = roughened(seen(toy(seed)), seed)
    return [views[round(place * len(views) / count)] for place in range(count)]


def posed(views: Sequence[View], fault: str) -> list[View]:
    poses = FAULTS[fault]([view.world_from_camera for view in views])
    return [
        View(camera=view.camera, world_from_camera=pose, mask=view.mask)
        for view, pose in zip(views, poses, strict=True)
    ]


def body_of(views: Sequence[View]) -> ModelResult | None:
    try:
        return fit(views, max_ellipsoids=4, delta=0.0, seed=0)
    except ModelError:
        return None  # such cameras see no common point


@pytest.mark.parametrize("count", tiered([4, 7, 5]))
def test_few_views_that_belong_to_their_poses_make_a_good_body(count: int) -> None:
    for seed in range(4):
        made = body_of(few(count, seed))
        assert made is not None and made.all_doubts == (), seed
        assert made.verdict.word == "good"


@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault != "y up"])
@pytest.mark.parametrize("count", tiered([3, 2, 4, 5, 7]))
def test_few_views_of_wrong_poses_never_make_a_good_body(count: int, fault: str) -> None:
    fitted = 0
    for seed in range(3):
        made = body_of(posed(few(count, seed), fault))
        if made is not None:
            assert made.verdict.word != "good", seed
            assert made.all_doubts, seed
            fitted += bool(made.iou_used.min() > 0.8)
    if (count, fault) in ((3, "reversed"), (4, "one line early")):
        assert fitted  # which the overlap alone would have called good


@pytest.mark.extended
@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_wrong_with_few_poses_is_named(fault: str) -> None:
    for seed in range(3):
        try:
            told = "\n".join(fit(posed(few(5, seed), fault), seed=0).doubts)
        except ModelError as error:
            told = str(error)
        assert re.search(NAMED[fault], told), (seed, told)


def looks(count: int, seed: int, fault: str | None) -> list[View]:
    """Return views of two eyes beside each other from `count` places, whose poses may be wrong."""
    drawing = toy(seed)
    all_around = [Pose(pose) for pose in drawing.world_from_cameras()]
    places = [all_around[round(place * len(all_around) / count)] for place in range(count)]
    eyes = [Pose.from_parts((side, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)) for side in (0.0, EYES_M)]
    wrong = places if fault is None else FAULTS[fault](places)
    return [
        View(
            camera=CAMERA,
            world_from_camera=given @ eye,
            mask=drawing.mask((true @ eye).matrix()),
        )
        for true, given in zip(places, wrong, strict=True)
        for eye in eyes
    ]


@pytest.mark.parametrize(
    ("count", "fault"), tiered([(3, "reversed"), (3, "two exchanged"), (4, "reversed")])
)
def test_two_eyes_confirm_no_wrong_pose_of_each_other(count: int, fault: str) -> None:
    for seed in range(2):
        made = body_of(looks(count, seed, fault))
        assert made is None or (made.verdict.word != "good" and made.all_doubts), seed
    right = body_of(looks(4, 0, None))
    assert right is not None and right.all_doubts == ()


def test_views_are_grouped_by_the_direction_in_which_they_look() -> None:
    assert directions(looks(3, 0, None)) == [[0, 1], [2, 3], [4, 5]]
    assert directions(few(5, 0)) == [[0], [1], [2], [3], [4]]


def test_two_views_alone_are_never_called_good() -> None:
    made = body_of(few(2, 0))
    assert made is not None and np.all(made.iou_used > 0.8)
    assert made.verdict.words.startswith("rough, as it is in doubt: the body explains")
    assert "nothing confirms the poses of these 2 views" in made.doubts[0]


def test_views_that_were_not_used_confirm_the_poses_as_well() -> None:
    made = fit(few(4, 0), views=slice(0, 2), seed=0)
    assert not any("confirms" in doubt for doubt in made.doubts)
    assert len(made.iou_unused) == 2


def test_long_comparisons_say_what_they_do() -> None:
    stages = []
    with contextlib.suppress(ModelError):
        fit(
            posed(few(4, 0), "reversed"), max_ellipsoids=3, delta=0.0, seed=0,
            progress=lambda told: stages.append(told.stage),
        )  # fmt: skip
    assert stages.count("comparing the views with each other") == 1
    assert stages.count("comparing other orders of the poses") == 6

"""Images that do not belong to their poses are noticed, and hard captures are not blamed."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from commands import Command
from tiers import tiered
from toys import VIEWS, roughened, seen, toy

from servoid.capture import View, open_capture
from servoid.errors import ModelError
from servoid.model import fit, fit_capture
from servoid.pose import Pose

NEXT = "if each image takes the pose of the next line"
BACK = "if each image takes the pose of the line before"
REVERSED = "if the poses are taken in reversed order"


def with_masks_of(views: Sequence[View], order: Sequence[int]) -> list[View]:
    return [
        View(camera=view.camera, world_from_camera=view.world_from_camera, mask=views[other].mask)
        for view, other in zip(views, order, strict=True)
    ]


def notes_of(views: Sequence[View]) -> str:
    return "\n".join(fit(views, max_ellipsoids=3, delta=0.0, seed=0).all_notes)


FAULTS: dict[str, tuple[Callable[[int], list[int]], str]] = {
    "one line late": (lambda count: [(index - 1) % count for index in range(count)], BACK),
    "one line early": (lambda count: [(index + 1) % count for index in range(count)], NEXT),
    "reversed": (lambda count: list(range(count))[::-1], REVERSED),
}


CV_FROM_GL = Pose.from_parts((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))
CONVENTIONS: dict[str, tuple[Callable[[Pose], Pose], str]] = {
    "inverted": (Pose.inverse, "the poses look like camera_from_world: invert them; then a body"),
    "y up": (lambda pose: pose @ CV_FROM_GL, "with y up and z backwards, as in OpenGL .*; then a"),
    "w last": (
        lambda pose: Pose.from_parts(pose.translation, pose.xyzw),
        "quaternions in the order x, y, z, w, as in ROS and SciPy: write w first; then a",
    ),
}


@pytest.mark.parametrize("seed", tiered(range(2)))
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_poses_of_another_convention_are_told_and_the_convention_is_named(
    convention: str, seed: int
) -> None:
    turned, words = CONVENTIONS[convention]
    views = [
        View(camera=one.camera, world_from_camera=turned(one.world_from_camera), mask=one.mask)
        for one in roughened(seen(toy(seed)), seed)
    ]
    try:
        told = notes_of(views)
    except ModelError as error:  # such cameras may see no common point
        told = str(error)
    assert re.search(words, told)


@pytest.mark.parametrize("seed", tiered(range(2)))
@pytest.mark.parametrize("fault", tiered(reversed(FAULTS)))
def test_poses_in_another_order_than_the_images_are_told_and_the_order_is_named(
    fault: str, seed: int
) -> None:
    order, words = FAULTS[fault]
    views = seen(toy(seed))
    for given in (views, roughened(views, seed)):
        notes = notes_of(with_masks_of(given, order(VIEWS)))
        assert "do not belong together" in notes
        assert words in notes


@pytest.mark.parametrize("seed", tiered(range(5), 2))
def test_a_hard_capture_is_not_blamed_for_its_order(seed: int) -> None:
    views = seen(toy(seed))
    for given in (views, roughened(views, seed)):
        notes = notes_of(given)
        assert "belong together" not in notes and "look exchanged" not in notes


@pytest.mark.parametrize(
    ("seed", "pair"), tiered([(0, (1, 7)), (1, (2, 3)), (2, (0, 10)), (3, (4, 9))], 2)
)
def test_two_exchanged_views_are_named(seed: int, pair: tuple[int, int]) -> None:
    views = seen(toy(seed))
    order = list(range(VIEWS))
    order[pair[0]], order[pair[1]] = pair[1], pair[0]
    notes = notes_of(with_masks_of(views, order))
    names = [f"view/{index}" for index in pair]
    assert any(f"{a} and {b} look exchanged" in notes for a, b in (names, names[::-1]))
    assert notes.count("look exchanged") == 1
    assert "belong together" not in notes


@pytest.mark.extended
@pytest.mark.parametrize("fault", ["one line", "reversed"])
def test_a_poses_csv_in_another_order_is_told_in_the_summary(
    fault: str, tmp_path: Path, servoid_command: Command
) -> None:
    folder = toy(1).write(tmp_path / "toy")
    header, *lines = (folder / "poses.csv").read_text().splitlines()
    times = [line.split(",", 1)[0] for line in lines]
    poses = [line.split(",", 1)[1] for line in lines]
    poses = poses[::-1] if fault == "reversed" else [*poses[1:], poses[-1]]
    rows = [f"{time},{pose}" for time, pose in zip(times, poses, strict=True)]
    (folder / "poses.csv").write_text("\n".join([header, *rows, ""]))
    done = servoid_command("model", folder, "--out", tmp_path / "body.json")
    assert done.code == 0, done.err
    words = " ".join(done.out.split())
    assert "doubt images and poses do not belong together: if " in words
    assert (REVERSED if fault == "reversed" else BACK) in words


@pytest.mark.extended
def test_a_shift_is_told_though_every_second_image_has_a_mask(tmp_path: Path) -> None:
    folder = toy(2).write(tmp_path / "toy")
    header, *lines = (folder / "poses.csv").read_text().splitlines()
    (folder / "poses.csv").write_text("\n".join([header, *lines[1:], lines[-1], ""]))
    for index in range(1, VIEWS, 2):
        (folder / "masks" / f"{index:04}.png").unlink()
    capture = open_capture(folder)
    kept = [view for view in capture.all_views() if view.has_mask]
    assert len(kept) == 6
    notes = "\n".join(fit_capture(capture).notes)
    assert BACK in notes


@pytest.mark.extended
@pytest.mark.parametrize("name", ["temple", "skull", "blowtorch"])
def test_photographs_belong_together_as_they_are_and_not_reversed(
    name: str, photos: Callable[[str], Path]
) -> None:
    views = [view.view() for view in open_capture(photos(name)).views()]
    notes = notes_of(views)
    assert "belong together" not in notes and "look exchanged" not in notes
    assert REVERSED in notes_of(with_masks_of(views, list(range(len(views)))[::-1]))
    assert "takes the pose of the" in notes_of(with_masks_of(views, [*range(1, len(views)), 0]))

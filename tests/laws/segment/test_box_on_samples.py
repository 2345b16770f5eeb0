"""Boxes drawn around the objects of `servoid sample`: accepted and right, wherever a hand errs."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes_found import iou
from tiers import tiered

from servoid.capture import open_capture
from servoid.model.marking import mark
from servoid.segment import BoxTarget
from servoid.sim import Scenario, write_moving_sample, write_sample

MOVES = [
    (0, 0, 0, 0), (-3, -3, 3, 3), (3, 3, 3, 3), (-3, -3, -3, -3), (3, -3, 3, -3), (-3, 3, -3, 3),
    (3, 3, -3, -3),
]  # fmt: skip


def marked_masks(folder: Path, slack: float) -> list[NDArray[np.uint8]]:
    """Return what boxes find that are moved by 3 px, in a sample's first image; then its mask.

    The boxes are larger than the object by a share of its size, as a hand draws them.
    """
    capture = open_capture(folder)
    truth = capture.views()[0].mask()
    rows, columns = np.nonzero(truth)
    aside = slack * max(np.ptp(rows), np.ptp(columns))
    corners = np.array([columns.min(), rows.min(), columns.max(), rows.max()], np.float64)
    corners += aside * np.array([-1.0, -1.0, 1.0, 1.0])
    only = slice(0, 1)
    boxes = [BoxTarget(*(corners + move).tolist()) for move in MOVES]
    found = [mark(capture, [box], only).views[0].mask() for box in boxes]
    return [*found, truth]


@pytest.mark.parametrize(("slack", "least"), tiered([(0.03, 0.9), (0.05, 0.88), (0.08, 0.88)]))
@pytest.mark.parametrize("size", ["small", "full"])
def test_a_box_around_the_moving_toy_is_accepted_among_things_of_its_colours(
    size: str, slack: float, least: float, tmp_path: Path
) -> None:
    scenario = Scenario(count=1, size=size, occluder=size == "small")
    *found, truth = marked_masks(write_moving_sample(tmp_path / "toy", scenario), slack)
    assert min(iou(mask, truth) for mask in found) >= least


@pytest.mark.extended
def test_a_box_around_the_resting_bird_is_accepted(tmp_path: Path) -> None:
    *found, truth = marked_masks(write_sample(tmp_path / "bird", views=1), 0.05)
    assert min(iou(mask, truth) for mask in found) >= 0.9


def test_a_box_says_so_if_another_camera_cannot_tell_its_depth(tmp_path: Path) -> None:
    folder = write_moving_sample(tmp_path / "toy", Scenario(count=1, size="small"))
    capture = open_capture(folder)
    rows, columns = np.nonzero(capture.views()[0].mask())
    box = BoxTarget(columns.min() - 3, rows.min() - 3, columns.max() + 3, rows.max() + 3)
    assert mark(capture, [box]).doubts == ()
    _, other = capture.all_views()
    other.image_path.write_bytes(other.image_path.read_bytes()[:500])
    notes = " ".join(mark(capture, [box], trusted=True).doubts)
    assert "no depth from" in notes and other.image_path.name in notes

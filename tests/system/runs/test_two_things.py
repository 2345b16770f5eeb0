"""A mask of two things is noticed once they move apart, and no pose is trusted from then on."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes_trust import ALL_COURSES, drawn_course, true_poses
from tiers import tiered
from tracks_through import tracks_through
from trust_verdicts import Verdicts, verdicts

from servoid.capture import open_capture
from servoid.track import Request

NOTICE = "move otherwise than the rest"
BESIDE_PX = 50  # of the background that is marked as well


def marked(seed: int, folder: Path, beside_px: int) -> Path:
    """Mark an object that turns, and that much of the printed wall beside it."""
    folder = Path(shutil.copytree(drawn_course("turn", seed), folder / "marked"))
    place = folder / "masks" / "0000.png"
    mask = cv2.imread(str(place), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    if beside_px:
        x, y, width, height = cv2.boundingRect(mask)
        right = min(x + width + beside_px, mask.shape[1] - 2)
        mask[y + height // 5 : y + height, x + width - 4 : right] = 255
    cv2.imwrite(str(place), mask)
    return folder


def followed(seed: int, folder: Path) -> tuple[Verdicts, list[bool]]:
    """Track what is marked; return verdicts, and in which images two things are noticed."""
    result = tracks_through(open_capture(folder), None, Request(seed=seed))[0]
    vertices = ALL_COURSES["turn"].vertices(seed)
    noticed = [any(NOTICE in note for note in one.notices) for one in result.tracked]
    for one, is_noticed in zip(result.tracked, noticed, strict=True):
        estimate = one.estimate
        assert not is_noticed or (estimate.status != "tracking" and not estimate.located)
        assert not is_noticed or estimate.confidence < 0.5
    return verdicts(result.tracked, true_poses(folder), vertices), noticed


# Without the notice 52 images of the first and 38 of the second are wrong and trusted.
@pytest.mark.parametrize("seed", tiered((5, 3), 1))
def test_two_things_that_were_marked_as_one_are_not_trusted_once_they_move_apart(
    seed: int, tmp_path: Path
) -> None:
    found, noticed = followed(seed, marked(seed, tmp_path, BESIDE_PX))
    assert any(noticed[:15])
    assert int(found.trusted_wrong.sum()) <= 5
    first = noticed.index(True)
    assert not np.any(found.trusted_wrong[found.index >= first])


@pytest.mark.extended
@pytest.mark.parametrize("seed", (5, 3, 2))
def test_an_object_that_was_marked_alone_is_one_thing(seed: int, tmp_path: Path) -> None:
    found, noticed = followed(seed, marked(seed, tmp_path, 0))
    assert not any(noticed)
    assert np.any(found.right)

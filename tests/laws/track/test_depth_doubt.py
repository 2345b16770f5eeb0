"""Depth images that say nothing, or are not used, are told."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from trust_scenes import SMALL, write_depth_course

from servoid.capture import Capture
from servoid.errors import ModelError
from servoid.exchange import open_any
from servoid.model import fit_capture
from servoid.track import TrackResult, track_capture

Change = Callable[[NDArray[np.uint16], int], NDArray[np.uint16] | None]

DRILL = 2
IMAGES = 8


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Draw a drill that turns, as one camera with depth sees it."""
    return write_depth_course(tmp_path_factory.mktemp("d") / "drill", "turn", DRILL, SMALL, IMAGES)


def changed(
    drawn: Path,
    folder: Path,
    change: Callable[[NDArray[np.uint16], int], NDArray[np.uint16] | None],
) -> Capture:
    """Open a copy with each depth image changed, or left out."""
    for path in drawn.rglob("*.*"):
        place = folder / path.relative_to(drawn)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(path.read_bytes())
    for index, path in enumerate(sorted((folder / "depth").iterdir())):
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert depth is not None
        new = change(depth.astype(np.uint16), index)
        if new is None:
            path.unlink()
        else:
            assert cv2.imwrite(str(path), new)
    return open_any(folder)


def tracked(capture: Capture) -> TrackResult:
    (result,) = track_capture(capture)
    return result


def test_depth_that_drifts_is_a_doubt_with_its_causes(drawn: Path, tmp_path: Path) -> None:
    def drift(depth: NDArray[np.uint16], index: int) -> NDArray[np.uint16]:
        return (depth * (1.0 + 0.15 * index)).astype(np.uint16)

    result = tracked(changed(drawn, tmp_path, drift))
    assert result.depth_doubt is not None
    assert "late or of another time, of another camera, or in a unit that is wrong or drifts" in (
        result.depth_doubt
    )
    assert result.depth_doubt in result.capture_doubts
    assert "the depth images are in doubt" in result.reasons
    assert result.verdict != "good"


def test_right_depth_is_no_doubt(drawn: Path) -> None:
    assert tracked(open_any(drawn)).depth_doubt is None


def test_depth_that_becomes_empty_is_noticed_in_each_image(drawn: Path, tmp_path: Path) -> None:
    result = tracked(changed(drawn, tmp_path, lambda depth, at: depth if at < 5 else 0 * depth))
    empty = [
        one.index
        for one in result.tracked
        if any("left: the depth image has no distance in any pixel" in a for a in one.notices)
    ]
    assert empty == list(range(5, IMAGES))


@pytest.mark.parametrize(
    ("is_outside", "words"),
    [
        (False, "the depth image of left/0000 has no distance in any pixel"),
        (True, "the depth image of left/0000 has no distance in the object's mask, but in "),
    ],
)
def test_depth_without_the_object_is_told_where_its_distance_is_asked_for(
    drawn: Path, tmp_path: Path, is_outside: bool, words: str
) -> None:
    mask = cv2.imread(str(drawn / "masks" / "0000.png"), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    seen = mask == 0 if is_outside else np.zeros_like(mask, bool)
    only = np.where(seen, 1000, 0).astype(np.uint16)
    capture = changed(drawn, tmp_path, lambda *_: only)
    with pytest.raises(ModelError) as caught:
        fit_capture(capture, observations=slice(0, 1))
    assert words in str(caught.value)
    assert "distance_m=0.6 in Python" in str(caught.value)


def test_the_first_observation_with_depth_is_named_where_the_first_has_none(
    drawn: Path, tmp_path: Path
) -> None:
    capture = changed(drawn, tmp_path, lambda depth, at: None if at < 3 else depth)
    with pytest.raises(ModelError, match=r"observation 3 has: begin there \(--observations 3:"):
        fit_capture(capture, observations=slice(0, 1))

"""Depth images that are not registered to the colour images put all poses in doubt."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tiers import tiered
from trust_scenes import SMALL, write_depth_course

from servoid.exchange import open_any
from servoid.model import misregistered
from servoid.track import track_capture

Change = Callable[[NDArray[np.uint16]], NDArray[np.uint16]]
DRILL, BOTTLE = 2, 0


def right(depth: NDArray[np.uint16]) -> NDArray[np.uint16]:
    return depth


def with_holes(depth: NDArray[np.uint16]) -> NDArray[np.uint16]:
    blocks = np.random.default_rng(0).uniform(size=(depth.shape[0] // 8, depth.shape[1] // 8))
    return np.where(np.kron(blocks < 0.4, np.ones((8, 8))) > 0.0, 0, depth).astype(np.uint16)


def with_flying_pixels(depth: NDArray[np.uint16]) -> NDArray[np.uint16]:
    return np.asarray(cv2.blur(depth, (7, 7)), np.uint16)


def with_a_shadow(depth: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return it as of a sensor whose light comes from the side: beside what is near is nothing."""
    near = (depth > 0) & (depth < np.quantile(depth[depth > 0], 0.1) + 500)
    return np.where(np.roll(near, 12, axis=1) & ~near, 0, depth).astype(np.uint16)


def aside(pixels: int) -> Change:
    return lambda depth: np.roll(depth, pixels, axis=1)


def wider(depth: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return it as of a camera with a field of view that is a third wider."""
    height, width = depth.shape
    small = (3 * width // 4, 3 * height // 4)
    whole = np.zeros_like(depth)
    inner = np.asarray(cv2.resize(depth, small, interpolation=cv2.INTER_NEAREST))
    top, left = (height - small[1]) // 2, (width - small[0]) // 2
    whole[top : top + small[1], left : left + small[0]] = inner
    return whole


def changed(folder: Path, change: Change) -> Path:
    for path in sorted((folder / "depth").iterdir()):
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert depth is not None
        assert cv2.imwrite(str(path), change(depth.astype(np.uint16)))
    return folder


def recording(folder: Path, change: Change, seed: int, images: int) -> Path:
    return changed(write_depth_course(folder, "turn", seed, SMALL, images), change)


@pytest.mark.parametrize("seed", tiered([DRILL, BOTTLE]))
@pytest.mark.parametrize("change", [right, with_holes, with_flying_pixels, with_a_shadow])
def test_depth_in_its_place_is_not_doubted(tmp_path: Path, change: Change, seed: int) -> None:
    capture = open_any(recording(tmp_path / "one", change, seed, 1))
    assert misregistered(capture.views()) is None


@pytest.mark.parametrize("seed", tiered([DRILL, BOTTLE]))
@pytest.mark.parametrize(
    ("change", "shift_px", "scale"),
    [(aside(-20), -20, 1.0), (aside(30), 30, 1.0), (wider, 0, 0.75)],
)
def test_depth_beside_its_image_is_found_with_its_shift_and_size(
    tmp_path: Path, change: Change, shift_px: int, scale: float, seed: int
) -> None:
    capture = open_any(recording(tmp_path / "one", change, seed, 1))
    found = misregistered(capture.views())
    assert found is not None and found.is_sure
    assert abs(found.shift_px[0] - shift_px) < 8 or scale < 1.0
    assert abs(found.scale - scale) < 0.13
    assert "align depth to colour" in found.words


def test_no_pose_is_trusted_where_depth_is_not_registered(tmp_path: Path) -> None:
    (result,) = track_capture(open_any(recording(tmp_path / "one", aside(24), DRILL, 4)))
    assert {one.estimate.status for one in result.tracked} == {"searching"}
    assert all(one.estimate.confidence == 0.0 for one in result.tracked)
    assert any("not registered to the colour image" in doubt for doubt in result.doubts)
    assert result.verdict == "poor"


def test_poses_are_trusted_where_depth_is_registered(tmp_path: Path) -> None:
    (result,) = track_capture(open_any(recording(tmp_path / "one", right, DRILL, 4)))
    assert {one.estimate.status for one in result.tracked} == {"tracking"}
    assert not result.doubts

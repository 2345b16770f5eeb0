"""What matches alone tell of a camera: made without images, by points and two cameras or more."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from rooms_to_scan import print_of, write_film
from scipy.spatial.transform import Rotation

from servoid.errors import ScanError
from servoid.scan import motion
from servoid.scan.footage import open_footage
from servoid.scan.keys import choose_keys
from servoid.scan.matching import Matched, choose_pairs

SIZE_PX = (640, 480)
FOCAL_PX = 560.0
COUNT = 300
Array = NDArray[np.float64]


def seen(turn_deg: float, shift: float, points: Array) -> Array:
    """Return where a camera sees points, after it turned and went to the side."""
    turn = Rotation.from_euler("y", turn_deg, degrees=True).as_matrix()
    local = (points - [shift, 0.0, 0.0]) @ turn
    return FOCAL_PX * local[:, :2] / local[:, 2:] + (np.array(SIZE_PX) - 1.0) / 2.0


def matched(places: list[Array], noise_px: float = 0.3) -> Matched:
    """Join what images see of the same points."""
    rng = np.random.default_rng(0)
    rows = np.repeat(np.arange(COUNT)[:, None], 2, axis=1)
    pairs = {(i, j): rows for i in range(len(places)) for j in range(i + 1, len(places))}
    return Matched(
        names=tuple(f"{index:04}" for index in range(len(places))),
        files=tuple(f"{index:04}.jpg" for index in range(len(places))),
        size_px=SIZE_PX,
        database=Path("none"),
        keypoints=tuple(one + noise_px * rng.normal(size=one.shape) for one in places),
        alike=pairs,
        agreeing=pairs,
    )


def cloud(depth: tuple[float, float]) -> Array:
    rng = np.random.default_rng(1)
    far = rng.uniform(*depth, COUNT)
    return np.stack([rng.uniform(-0.4, 0.4, COUNT), rng.uniform(-0.3, 0.3, COUNT), far], axis=1)


@pytest.mark.parametrize("depth", [(0.8, 2.0), (1.0, 1.0001)])
def test_a_camera_that_only_turns_is_told(depth: tuple[float, float]) -> None:
    places = [seen(turn, 0.0, cloud(depth)) for turn in (-8.0, -3.0, 2.0, 7.0)]
    with pytest.raises(ScanError, match="only rotates"):
        motion.check_turning(matched(places))


@pytest.mark.parametrize("turn", [0.0, -0.6])
def test_a_camera_that_goes_past_things_at_several_depths_does_not_only_turn(turn: float) -> None:
    places = [seen(turn * step, 0.05 * step, cloud((0.8, 2.0))) for step in range(4)]
    motion.check_turning(matched(places))
    motion.check_camera_moves(matched(places))


def test_a_camera_that_goes_past_a_wall_does_not_only_turn() -> None:
    places = [seen(5.0 * step, -0.15 * step, cloud((1.0, 1.0001))) for step in range(4)]
    motion.check_turning(matched(places))


def test_a_camera_that_only_turns_and_one_that_goes_along_a_wall_are_told_both_causes() -> None:
    along = [seen(0.0, 0.1 * step, cloud((1.0, 1.0001))) for step in range(4)]
    turning = [seen(turn, 0.0, cloud((0.8, 2.0))) for turn in (-8.0, -3.0, 2.0, 7.0)]
    for places in (along, turning):
        with pytest.raises(ScanError, match=r"rotates, or passes by a flat .* stand out from it"):
            motion.check_turning(matched(places))


def test_a_camera_that_stands_is_told_from_one_before_which_something_moves() -> None:
    points = cloud((0.8, 2.0))
    still = [seen(0.0, 0.0, points) for _ in range(4)]
    with pytest.raises(ScanError, match="does not move"):
        motion.check_camera_moves(matched(still))
    for index, places in enumerate(still):
        places[:30] += [9.0 * index, 0.0]
    message = r"object moves before a static .* % move between neighbouring images.*--turntable"
    with pytest.raises(ScanError, match=message):
        motion.check_camera_moves(matched(still))


def test_images_without_features_are_refused() -> None:
    few = matched([seen(0.0, 0.0, cloud((1.0, 2.0)))[:40] for _ in range(3)])
    with pytest.raises(ScanError, match="40 features in the median one"):
        motion.check_features(few)


@pytest.mark.parametrize(("count", "film"), [(20, True), (80, False), (120, True), (300, False)])
def test_pairs_join_neighbours_and_the_ends_with_bounded_work(count: int, film: bool) -> None:
    pairs = choose_pairs(count, is_film=film)
    assert len(set(pairs)) == len(pairs) and all(i < j for i, j in pairs)
    assert {(i, i + 1) for i in range(count - 1)} <= set(pairs)
    assert (0, count - 1) in pairs
    assert len(pairs) <= 3200


def test_key_images_are_sharp_and_as_far_apart_as_the_image_moves(tmp_path: Path) -> None:
    wide = print_of(4)[:180]
    images = []
    for index in range(150):  # it goes, stands, and goes on; only every third image is sharp
        at = min(index, 60) + max(index - 90, 0)
        image = np.ascontiguousarray(wide[:, at : at + 240])
        images.append(image if index % 3 == 0 else cv2.GaussianBlur(image, (0, 0), 2.5))
    film = open_footage(write_film(tmp_path / "film.avi", images))
    keys = choose_keys(film, wanted=("0044",))
    numbers = [int(key) for key in keys]
    assert keys[0] == "0000" and "0044" in keys
    assert len(keys) < 45
    others = [number for number in numbers if number not in (0, 44)]
    assert np.mean([number % 3 == 0 for number in others]) > 0.8
    standing = [number for number in others if 61 < number < 90]
    assert len(standing) <= 2

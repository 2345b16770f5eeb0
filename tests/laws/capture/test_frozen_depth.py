"""Depth images that do not change while the images do are of another time."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.camera import Camera
from servoid.capture import Capture, PosedImage, capture_of, doubt_step
from servoid.pose import Pose

SIZE_PX = (80, 60)
COUNT = 12


def recording(*, moves: bool, seed: int = 0) -> Capture:
    """Record a bright square before a dark wall, at rest or not, with noise of 4 grey levels."""
    random = np.random.default_rng(seed)
    camera = Camera(size_px=SIZE_PX, focal_px=(70.0, 70.0), center_px=(39.5, 29.5))
    observations = []
    for index in range(COUNT):
        left = 10 + (3 * index if moves else 0)
        image = random.normal(60.0, 4.0, (60, 80, 3))
        image[20:40, left : left + 20] += 120.0
        observations.append(
            [
                PosedImage(
                    camera=camera,
                    world_from_camera=Pose(np.eye(4)),
                    image=np.clip(image, 0.0, 255.0).astype(np.uint8),
                )
            ]
        )
    return capture_of(observations, rate_hz=30.0)


def with_depth(capture: Capture, depths: list[NDArray[np.float32] | None]) -> Capture:
    (camera,) = capture.cameras
    return replace(capture, cameras=(replace(camera, depths_m=tuple(depths)),))


def wall(seed: int) -> NDArray[np.float32]:
    depth = np.full(SIZE_PX[::-1], 0.8, np.float32)
    depth[0] = np.nan
    return depth + np.random.default_rng(seed).normal(0.0, 1e-4, depth.shape).astype(np.float32)


def test_depth_that_stands_still_while_images_move_is_doubted() -> None:
    moving = recording(moves=True)
    doubt = doubt_step(with_depth(moving, [wall(0)] * COUNT))
    assert doubt is not None and "do not change while its images do" in doubt
    assert doubt_step(with_depth(moving, [wall(index) for index in range(COUNT)])) is None


@pytest.mark.parametrize(
    "depths", [[None] * COUNT, [wall(0), *[None] * (COUNT - 1)], [wall(0), None] * (COUNT // 2)]
)
def test_depth_that_is_rare_or_missing_is_not(depths: list[NDArray[np.float32] | None]) -> None:
    assert doubt_step(with_depth(recording(moves=True), depths)) is None


def test_depth_without_noise_of_a_scene_at_rest_is_not() -> None:
    assert doubt_step(with_depth(recording(moves=False), [wall(0)] * COUNT)) is None


def test_depth_without_a_distance_says_nothing() -> None:
    blind = np.full(SIZE_PX[::-1], np.nan, np.float32)
    assert doubt_step(with_depth(recording(moves=True), [blind] * COUNT)) is None


def test_only_observations_among_the_given_ones_are_compared() -> None:
    depths = [wall(0)] * 6 + [wall(index) for index in range(6, COUNT)]
    half = with_depth(recording(moves=True), depths)
    assert doubt_step(half) is None
    assert doubt_step(half, among=range(6)) is not None
    assert doubt_step(half, among=range(6, COUNT)) is None
    assert doubt_step(half, among=[0, 3, 5]) is None

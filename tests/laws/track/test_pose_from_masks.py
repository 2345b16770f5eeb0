from itertools import combinations

import numpy as np
import pytest
from fake_tracker import plain_body
from scenes_found import COLORS, body_at, marked, placed

from servoid.errors import ImageError, TrackError
from servoid.pose import Pose
from servoid.track import pose_from_masks, poses_from_masks


@pytest.mark.parametrize("seed", range(4))
def test_a_body_is_found_where_its_masks_were_drawn(seed: int) -> None:
    assert placed.broken(seed) == []


def test_the_same_seed_places_at_the_same_bits() -> None:
    views, images = marked(body_at(Pose.from_parts((0.0, 0.0, 0.5), (0.8, 0.6, 0.0, 0.0))), 1)
    first, again = (
        pose_from_masks(body_at(Pose.identity()), views, images, COLORS, 7)[0] for _ in range(2)
    )
    assert np.array_equal(first.matrix(), again.matrix())


def test_without_a_mask_nothing_is_placed() -> None:
    with pytest.raises(TrackError, match="there is none; give a target or a start"):
        pose_from_masks(body_at(Pose.identity()), [])


def test_masks_images_and_colors_must_belong_together() -> None:
    true = body_at(Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0)))
    views, images = marked(true)
    with pytest.raises(ImageError, match="2 cameras needs as many images, but was given 1"):
        pose_from_masks(true, views, images[:1], COLORS)
    with pytest.raises(TrackError, match="3 ellipsoids has as many colours, but 2 were given"):
        pose_from_masks(true, views, images, COLORS[:2])


def turns_between(poses: list[Pose]) -> list[float]:
    """Return the angles between all pairs of poses, in degrees."""
    logs = [(one.inverse() @ other).log()[3:] for one, other in combinations(poses, 2)]
    return [float(np.degrees(np.linalg.norm(log))) for log in logs]


@pytest.mark.parametrize("seed", range(2))
def test_poses_that_fit_as_well_are_apart_and_begin_with_the_one_that_is_used(seed: int) -> None:
    turn = np.random.default_rng(seed).normal(size=4)
    true = Pose.from_parts((0.0, 0.0, 0.5), (turn / np.linalg.norm(turn)).tolist())
    views, images = marked(body_at(true))
    body = body_at(Pose.identity())
    for colors in (COLORS, None):
        given = (views, None if colors is None else images, colors, seed)
        found = poses_from_masks(body, *given)
        best, iou = pose_from_masks(body, *given)
        assert np.array_equal(found[0][0].matrix(), best.matrix()) and found[0][1] == iou
        assert all(degrees >= 20.0 for degrees in turns_between([pose for pose, _ in found]))
        assert colors is not None or all(iou - 0.02 <= other <= iou for _, other in found)


def test_masks_of_two_equal_balls_fit_either_way_round_and_more() -> None:
    pair = plain_body(Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0)), count=2)
    views, _ = marked(pair)
    found = [pose for pose, _ in poses_from_masks(pair, views)]
    assert max(turns_between(found)) > 150.0

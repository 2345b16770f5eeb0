import numpy as np
import pytest
from scenes_found import COLORS, body_at, marked, placed

from servoid.errors import ImageError, TrackError
from servoid.pose import Pose
from servoid.track import pose_from_masks


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

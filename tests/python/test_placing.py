import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from servoid.errors import TrackError
from servoid.observe import Camera
from servoid.pose import Pose
from servoid.shape import Body
from servoid.track import Marked, place_body
from servoid.track.placing import _painted

CAMERA = Camera(size_px=(320, 240), focal_px=(400.0, 400.0), center_px=(159.5, 119.5))
EYES = (Pose.identity(), Pose.from_parts((0.12, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))


def body_at(pose: Pose) -> Body:
    """Make a hand with a thumb: no turn of it looks like another from all sides."""
    return Body(
        world_from_object=pose,
        centers=np.array([[0.0, 0.0, 0.0], [0.06, 0.03, 0.0], [-0.05, 0.02, 0.03]]),
        radii=np.array([[0.06, 0.03, 0.02], [0.02, 0.045, 0.015], [0.02, 0.02, 0.03]]),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)),
    )


COLORS = np.array([[200, 60, 40], [40, 160, 60], [50, 70, 200]], dtype=np.uint8)


def marked(body: Body, count: int = 2) -> list[Marked]:
    views = []
    for eye in EYES[:count]:
        mask = body.silhouette(CAMERA, eye)
        blank = Marked(CAMERA, eye, mask, np.full((*mask.shape, 3), 110, np.uint8))
        painted, known = _painted(body, body.world_from_object, blank, COLORS)
        blank.image[known] = painted[known]
        views.append(blank)
    return views


@pytest.mark.parametrize("seed", range(4))
def test_a_body_is_found_where_its_masks_were_drawn(seed: int) -> None:
    x, y, z, w = Rotation.random(random_state=seed).as_quat()
    true = body_at(Pose.from_parts((0.05, -0.03, 0.6), (w, x, y, z)))
    found = place_body(body_at(Pose.identity()), marked(true), COLORS, seed)
    off = true.world_from_object.inverse() @ found.world_from_object
    assert found.iou > 0.93
    assert np.linalg.norm(off.translation) < 0.02
    assert np.linalg.norm(off.log()[3:]) < 0.35


def test_the_same_seed_places_at_the_same_bits() -> None:
    views = marked(body_at(Pose.from_parts((0.0, 0.0, 0.5), (0.8, 0.6, 0.0, 0.0))), 1)
    first, again = (place_body(body_at(Pose.identity()), views, COLORS, 7) for _ in range(2))
    assert np.array_equal(first.world_from_object.matrix(), again.world_from_object.matrix())


def test_without_a_mask_nothing_is_placed() -> None:
    [view] = marked(body_at(Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))), 1)
    empty = Marked(CAMERA, EYES[0], np.zeros_like(view.mask), view.image)
    for views in ([], [empty]):
        with pytest.raises(TrackError, match="there is none; give a target or a start"):
            place_body(body_at(Pose.identity()), views)

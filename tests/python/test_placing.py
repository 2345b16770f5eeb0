import numpy as np
import pytest
from numpy.typing import NDArray

from servoid._native import View
from servoid.errors import ImageError, TrackError
from servoid.observe import Camera
from servoid.pose import Pose
from servoid.shape import Body
from servoid.track import place_body

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


Looks = tuple[list[View], list[NDArray[np.uint8]]]


def marked(body: Body, count: int = 2) -> Looks:
    """Draw masks of a body, and images of its ellipsoids, the nearest centre last."""
    views, images = [], []
    for eye in EYES[:count]:
        mask = body.silhouette(CAMERA, eye)
        image = np.full((*mask.shape, 3), 110, np.uint8)
        camera_from_object = eye.inverse() @ body.world_from_object
        for index in np.argsort(-camera_from_object.transform(body.centers)[:, 2]):
            part = Body(
                world_from_object=body.world_from_object,
                centers=body.centers[index : index + 1],
                radii=body.radii[index : index + 1],
                rotations=body.rotations[index : index + 1],
            )
            image[part.silhouette(CAMERA, eye) != 0] = COLORS[index]
        views.append(View(camera=CAMERA, world_from_camera=eye, mask=mask))
        images.append(image)
    return views, images


@pytest.mark.parametrize("seed", range(4))
def test_a_body_is_found_where_its_masks_were_drawn(seed: int) -> None:
    turn = np.random.default_rng(seed).normal(size=4)
    turn /= np.linalg.norm(turn)
    true = body_at(Pose.from_parts((0.05, -0.03, 0.6), turn.tolist()))
    views, images = marked(true)
    found, iou = place_body(body_at(Pose.identity()), views, images, COLORS, seed)
    off = true.world_from_object.inverse() @ found
    assert iou > 0.93
    assert np.linalg.norm(off.translation) < 0.02
    assert np.linalg.norm(off.log()[3:]) < 0.35


def test_the_same_seed_places_at_the_same_bits() -> None:
    views, images = marked(body_at(Pose.from_parts((0.0, 0.0, 0.5), (0.8, 0.6, 0.0, 0.0))), 1)
    first, again = (
        place_body(body_at(Pose.identity()), views, images, COLORS, 7)[0] for _ in range(2)
    )
    assert np.array_equal(first.matrix(), again.matrix())


def test_without_a_mask_nothing_is_placed() -> None:
    with pytest.raises(TrackError, match="there is none; give a target or a start"):
        place_body(body_at(Pose.identity()), [])


def test_masks_images_and_colors_must_belong_together() -> None:
    true = body_at(Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0)))
    views, images = marked(true)
    with pytest.raises(ImageError, match="2 images, but 1 were given"):
        place_body(true, views, images[:1], COLORS)
    with pytest.raises(TrackError, match="3 ellipsoids has 3 colours, but 2 were given"):
        place_body(true, views, images, COLORS[:2])

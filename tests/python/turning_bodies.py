"""Bodies of an object that turned: how alike they are, and how like the object."""

from dataclasses import dataclass

import numpy as np
from body_measures import WorldBody, overlap
from turning_scenes import Turning

from servoid.camera import Camera
from servoid.pose import Pose
from servoid.shape import Body
from servoid.track import Followed
from servoid.track.starting import placed
from servoid_experiments.modelling import around, design_of

POINTS = 100_000
VIEWS, ELEVATIONS_DEG, AWAY = 20, (12.0, 40.0, -15.0), 0.5
CAMERA = Camera(size_px=(320, 240), focal_px=(343.0, 343.0), center_px=(159.5, 119.5))


@dataclass(frozen=True)
class Likeness:
    """Intersection over union of two shapes, of their volumes and of silhouettes on average."""

    volume: float
    silhouette: float


def in_object(turning: Turning, one: Followed, body: Body | None = None) -> Body:
    """Return a body of a track, as it is now or another, in the object's frame."""
    index = one.first.index
    start = turning.truth[index].inverse() @ one.first.estimate.world_from_object
    return placed(one.body if body is None else body, start)


def like_object(body: Body, name: str) -> Likeness:
    """Compare a body in an object's frame with the object."""
    design = design_of(name)
    shares = [
        overlap(body.silhouette(CAMERA, pose) != 0, design.mask(CAMERA, pose) != 0)
        for pose in _views()
    ]
    return Likeness(design.volume_iou(body), float(np.mean(shares)))


def like(one: Body, other: Body) -> Likeness:
    """Compare two bodies in one frame."""
    solids = [WorldBody.stood(body) for body in (one, other)]
    reach = max(
        float(np.linalg.norm(solid.centers, axis=1).max() + solid.radii.max()) for solid in solids
    )
    points = np.random.default_rng(0).uniform(-reach, reach, (POINTS, 3))
    held = [solid.holds(points) for solid in solids]
    shares = [
        overlap(one.silhouette(CAMERA, pose) != 0, other.silhouette(CAMERA, pose) != 0)
        for pose in _views()
    ]
    return Likeness(overlap(held[0], held[1]), float(np.mean(shares)))


def _views() -> list[Pose]:
    return around(VIEWS, 0.3, ELEVATIONS_DEG, AWAY)

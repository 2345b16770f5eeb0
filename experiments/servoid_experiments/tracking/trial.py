"""A trial of tracking: models a body, and follows it through a scene."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from servoid._native import Body, Camera, ModelInput, ModelSettings, View, fit_body
from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import spun_like
from servoid.sim.accuracy import add_m
from servoid.sim.world.objects import SPIN_AXES
from servoid.track import Estimate
from servoid_experiments.modelling import around, design_of
from servoid_experiments.tracking.cases import TrackCase, TrackRow
from servoid_experiments.tracking.followers import start_follower
from servoid_experiments.tracking.footage import shoot

VIEWS, _ELEVATIONS_DEG = 10, (12.0, 40.0, -15.0)
_AWAY = 0.5
_CAMERA = Camera(size_px=(320, 240), focal_px=(343.0, 343.0), center_px=(159.5, 119.5))
_POINTS = 400  # of an object's surface


@dataclass(frozen=True, eq=False)
class Known:
    """A body of an object, in the object's frame, and points of its surface to evaluate poses.

    `points` is (N, 3) in the object's frame and `diameter` is the object's largest extent.
    """

    body: Body
    points: Floats
    diameter: float


def run_track_case(case: TrackCase) -> TrackRow:
    """Track an object through a scene, and return the error of each estimate.

    Raises:
        SimError: there is no such object.
        TrackError: the first images do not show it, or a setting is out of range.

    """
    footage = shoot(case.scene)
    known = known_of(case.scene.object, case.ellipsoids)
    axis = SPIN_AXES.get(case.scene.object)
    body_from_object = known.body.world_from_object.inverse()
    follower = start_follower(case, footage, known.body)
    row = TrackRow(position_mm=[], turn_deg=[], add_share=[], status=[], evaluations=0.0)
    evaluations = 0
    for index in range(1, case.scene.images):
        estimate = follower.step(index)
        evaluations += estimate.evaluations
        believed = estimate.world_from_object @ body_from_object
        truth = footage.world_from_objects[index]
        if axis is not None:
            truth = spun_like(truth, believed, np.array(axis))
        _add(row, estimate, (truth, believed), known)
    return TrackRow(
        position_mm=row.position_mm,
        turn_deg=row.turn_deg,
        add_share=row.add_share,
        status=row.status,
        evaluations=evaluations / len(row.status),
    )


TRACKING = Experiment("tracking", run_track_case, TrackCase, TrackRow)


def _add(row: TrackRow, estimate: Estimate, poses: tuple[Pose, Pose], known: Known) -> None:
    truth, believed = poses
    away = np.subtract(believed.translation, truth.translation)
    turn = (truth.inverse() @ believed).log()[3:]
    row.position_mm.append(1000.0 * float(np.linalg.norm(away)))
    row.turn_deg.append(float(np.degrees(np.linalg.norm(turn))))
    row.add_share.append(add_m(believed, truth, known.points) / known.diameter)
    row.status.append(estimate.status)


@lru_cache(maxsize=16)
def known_of(name: str, ellipsoids: int) -> Known:
    """Model an object from exact outlines on all sides; its frame is the world.

    Raises:
        SimError: there is no such object.

    """
    design = design_of(name)
    views = [
        View(camera=_CAMERA, world_from_camera=pose, mask=design.mask(_CAMERA, pose))
        for pose in around(VIEWS, 0.3, _ELEVATIONS_DEG, _AWAY, step=2.0 * np.pi / VIEWS)
    ]
    settings = ModelSettings(max_ellipsoids=ellipsoids, delta=0.0, quick=True, threads=1)
    body = fit_body(ModelInput(views=views), settings)[-1].body
    random = np.random.default_rng(0)
    voxels = design.voxels.middles
    points = design.vertices[random.choice(len(design.vertices), _POINTS)]
    spread = voxels[random.choice(len(voxels), _POINTS)]
    ends = np.concatenate([points, spread])
    diameter = np.linalg.norm(ends[:, None] - ends[None], axis=2).max()
    return Known(body, np.ascontiguousarray(points), float(diameter))

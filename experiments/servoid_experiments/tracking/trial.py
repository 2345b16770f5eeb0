"""A trial of tracking: models a body, and follows it through a scene."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from msgspec import Struct

from servoid._native import (
    Body,
    Camera,
    ModelInput,
    ModelSettings,
    OneStepSettings,
    OneStepTracker,
    fit_body,
)
from servoid.batch import Experiment
from servoid.pose.exact import Floats
from servoid.servo import spun_like
from servoid.sim.accuracy import add_m
from servoid.sim.world.objects import SPIN_AXES
from servoid.track import Method, Tracker, TrackSettings
from servoid_experiments.design import Count, about
from servoid_experiments.modelling.designs import around, design_of
from servoid_experiments.tracking.scene import RATE_HZ, Scene, SetUp, shoot

VIEWS, _ELEVATIONS_DEG = 10, (12.0, 40.0, -15.0)
_AWAY = 0.5
_CAMERA = Camera(size_px=(320, 240), focal_px=(343.0, 343.0), center_px=(159.5, 119.5))
_POINTS = 400  # of an object's surface


class TrackCase(Struct, frozen=True, kw_only=True):
    """A scene, and how the object is tracked in it.

    `generations` does not apply to the paper's method, which has one per image.
    """

    scene: Scene
    method: Method
    population: Count
    generations: Count
    ellipsoids: Count


class TrackRow(Struct, frozen=True, kw_only=True):
    """What a tracker reported in each image after the first, and its errors.

    The errors are those of the object's middle in mm, of its rotation in degrees, and ADD, the mean
    distance between its surface's true and tracked points, as a share of its diameter. The paper's
    method is given the rotation, so its rotation error is not a result.
    """

    position_mm: list[float]
    turn_deg: list[float]
    add_share: list[float]
    status: Annotated[list[str], about("tracking, searching or lost")]
    evaluations: Annotated[float, about("poses scored an image, on average")]


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

    The paper's tracker is given the rotation before each image, as in the paper's experiments.

    Raises:
        SimError: there is no such object.
        TrackError: the first images do not show it, or a setting is out of range.

    """
    set_up, images = shoot(case.scene)
    known = known_of(case.scene.object, case.ellipsoids)
    axis = SPIN_AXES.get(case.scene.object)
    object_from_body = known.body.world_from_object
    tracker = _start_tracker(case, set_up, known.body)
    position_mm, turn_deg, add_share, estimates = [], [], [], []
    for index, truth in enumerate(set_up.world_from_objects[1:], 1):
        if isinstance(tracker, OneStepTracker):
            tracker.set_orientation((truth @ object_from_body).quaternion)
        estimate = tracker.step(index / RATE_HZ, set_up.eyes, images[index])
        believed = estimate.world_from_object @ object_from_body.inverse()
        if axis is not None:
            truth = spun_like(truth, believed, np.array(axis))
        away = np.subtract(believed.translation, truth.translation)
        turn = (truth.inverse() @ believed).log()[3:]
        position_mm.append(1000.0 * float(np.linalg.norm(away)))
        turn_deg.append(float(np.degrees(np.linalg.norm(turn))))
        add_share.append(add_m(believed, truth, known.points) / known.diameter)
        estimates.append(estimate)
    return TrackRow(
        position_mm=position_mm,
        turn_deg=turn_deg,
        add_share=add_share,
        status=[one.status for one in estimates],
        evaluations=sum(one.evaluations for one in estimates) / len(estimates),
    )


TRACKING = Experiment("tracking", run_track_case, TrackCase, TrackRow)


def _start_tracker(case: TrackCase, set_up: SetUp, body: Body) -> Tracker | OneStepTracker:
    """Start the tracker of a case at the object's true pose; `body` is in the object's frame."""
    seed = case.scene.seed
    if case.method is Method.PAPER:
        one_step = OneStepSettings(seed=seed, population=case.population, turns=False)
        tracker: Tracker | OneStepTracker = OneStepTracker((set_up.camera,) * 2, body, one_step)
    else:
        settings = TrackSettings(
            seed=seed, population=case.population, generations=case.generations
        )
        tracker = Tracker((set_up.camera,) * 2, body, settings)
    truth = set_up.world_from_objects[0] @ body.world_from_object
    tracker.start(0.0, set_up.eyes, set_up.images(0), truth, set_up.masks(0))
    return tracker


@lru_cache(maxsize=16)
def known_of(name: str, ellipsoids: int) -> Known:
    """Model an object from exact outlines on all sides; its frame is the world.

    Raises:
        SimError: there is no such object.

    """
    design = design_of(name)
    poses = around(VIEWS, 0.3, _ELEVATIONS_DEG, _AWAY, step=2.0 * np.pi / VIEWS)
    views = design.views(_CAMERA, poses)
    settings = ModelSettings(max_ellipsoids=ellipsoids, delta=0.0, quick=True, threads=1)
    body = fit_body(ModelInput(views=views), settings)[-1].body
    random = np.random.default_rng(0)
    voxels = design.voxels.middles
    points = design.vertices[random.choice(len(design.vertices), _POINTS)]
    spread = voxels[random.choice(len(voxels), _POINTS)]
    ends = np.concatenate([points, spread])
    diameter = np.linalg.norm(ends[:, None] - ends[None], axis=2).max()
    return Known(body, np.ascontiguousarray(points), float(diameter))

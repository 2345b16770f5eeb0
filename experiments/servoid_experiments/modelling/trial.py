"""A trial of modelling: models an object from outlines, and compares the body with the truth."""

import time
from functools import lru_cache

import numpy as np

from servoid._native import Camera, ModelInput, ModelSettings, View, fit_body, silhouette_ious
from servoid.batch import Experiment
from servoid_experiments.modelling.around import around
from servoid_experiments.modelling.cases import ModelCase, ModelRow
from servoid_experiments.modelling.designs import DESIGNS, design_of
from servoid_experiments.modelling.noise import spoilt_mask, spoilt_pose

AWAY = 0.5  # metres from the object to the cameras
_FOCAL_OF_WIDTH = 1.25
ELEVATIONS_DEG = (20.0, 45.0, 5.0)
JUDGES, _JUDGES_BEGIN, _JUDGES_ELEVATIONS_DEG = 8, 1.0, (32.0, 12.0, 55.0)


def run_model_case(case: ModelCase) -> ModelRow:
    """Model an object from noisy outlines and compare the body with the truth.

    Raises:
        SimError: there is no such object.
        ModelError: the noisy outlines cannot be modelled.

    """
    random = np.random.default_rng(case.seed)
    design, camera = design_of(case.object), _camera(case.size_px)
    begin = float(random.uniform(0.0, 2.0 * np.pi))
    views = []
    for pose in around(case.views, begin, ELEVATIONS_DEG, AWAY):
        mask = spoilt_mask(design.mask(camera, pose), case, random)
        spoilt = spoilt_pose(pose, case, random)
        views.append(View(camera=camera, world_from_camera=spoilt, mask=mask))
    settings = ModelSettings(max_ellipsoids=case.ellipsoids, delta=0.0, seed=case.seed, threads=1)
    start = time.process_time()  # independent of other load on the machine
    body = fit_body(ModelInput(views=views), settings)[-1].body
    seconds = time.process_time() - start
    ious = silhouette_ious(body, _judges(case.object, case.size_px))
    return ModelRow(
        volume_iou=design.volume_iou(body),
        outline_iou=float(ious.mean()),
        worst_outline_iou=float(ious.min()),
        volume_share=body.mass_properties()[0] / design.voxels.total,
        seconds=seconds,
    )


MODELLING = Experiment("modelling", run_model_case, ModelCase, ModelRow)


@lru_cache(maxsize=len(DESIGNS))
def _judges(name: str, size_px: tuple[int, int]) -> tuple[View, ...]:
    """Return exact views of an object from which no trial models."""
    design, camera = design_of(name), _camera(size_px)
    return tuple(
        View(camera=camera, world_from_camera=pose, mask=design.mask(camera, pose))
        for pose in around(JUDGES, _JUDGES_BEGIN, _JUDGES_ELEVATIONS_DEG, AWAY)
    )


def _camera(size_px: tuple[int, int]) -> Camera:
    width, height = size_px
    focal = _FOCAL_OF_WIDTH * width
    return Camera(
        size_px=size_px,
        focal_px=(focal, focal),
        center_px=(0.5 * (width - 1), 0.5 * (height - 1)),
    )

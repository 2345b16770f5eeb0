"""A trial of modelling: models an object from noisy outlines, and compares it with the truth."""

import time
from functools import lru_cache
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from servoid._native import Camera, ModelInput, ModelSettings, View, fit_body, silhouette_ious
from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid_experiments.design import Count, NotNegative, about
from servoid_experiments.modelling.designs import DESIGNS, around, design_of

Share = Annotated[float, Meta(ge=0.0, le=0.9)]
Views = Annotated[int, Meta(ge=2)]
Mask = NDArray[np.uint8]

AWAY = 0.5  # metres from the object to the cameras
_FOCAL_OF_WIDTH = 1.25
ELEVATIONS_DEG = (20.0, 45.0, 5.0)
JUDGES, _JUDGES_BEGIN, _JUDGES_ELEVATIONS_DEG = 8, 1.0, (32.0, 12.0, 55.0)
_LUMP_PX = 12  # correlation length of the outline's error in pixels
_HOLE = 0.07  # radius, in square roots of the object's area


class ModelCase(Struct, frozen=True, kw_only=True):
    """Outlines of an object, their noise, and the number of ellipsoids of the model.

    Of the masks, `edge_px` is the error of the outline, `flipped` the share of wrong pixels, and
    `holes` the missing share of the object. Of the cameras' poses, `place_mm` and `turn_deg` are
    the errors of position and rotation. All but shares are standard deviations, those of poses
    about each axis.
    """

    object: str
    views: Views
    ellipsoids: Count
    edge_px: NotNegative
    flipped: Share
    holes: Share
    place_mm: NotNegative
    turn_deg: NotNegative
    size_px: tuple[int, int]
    seed: Annotated[int, Meta(ge=0)]


class ModelRow(Struct, frozen=True, kw_only=True):
    """The quality of a body, and the time that modelling took.

    Intersections over unions: of the volume with that of the design, and of the outlines in views
    that were not used, on average and in the worst view. Masks and poses of these are exact.
    """

    volume_iou: float
    outline_iou: float
    worst_outline_iou: float
    volume_share: float
    seconds: Annotated[float, about("of one processor for modelling; differs from run to run")]


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
def _judges(name: str, size_px: tuple[int, int]) -> list[View]:
    """Return exact views of an object from which no trial models."""
    poses = around(JUDGES, _JUDGES_BEGIN, _JUDGES_ELEVATIONS_DEG, AWAY)
    return design_of(name).views(_camera(size_px), poses)


def _camera(size_px: tuple[int, int]) -> Camera:
    width, height = size_px
    focal = _FOCAL_OF_WIDTH * width
    return Camera(
        size_px=size_px,
        focal_px=(focal, focal),
        center_px=(0.5 * (width - 1), 0.5 * (height - 1)),
    )


def spoilt_mask(mask: Mask, case: ModelCase, random: np.random.Generator) -> Mask:
    """Return a mask (H, W) with an error of its outline, holes, and wrong pixels."""
    if case.edge_px > 0.0:
        mask = _warped(mask, case.edge_px, random)
    if case.holes > 0.0:
        mask = _with_holes(mask, case.holes, random)
    if case.flipped > 0.0:
        mask = np.where(random.random(mask.shape) < case.flipped, 255 - mask, mask)
    return np.ascontiguousarray(mask, np.uint8)


def spoilt_pose(pose: Pose, case: ModelCase, random: np.random.Generator) -> Pose:
    """Return a camera's pose with errors of position and rotation."""
    place = random.normal(size=3) * 0.001 * case.place_mm
    turn = random.normal(size=3) * np.radians(case.turn_deg)
    moved = Pose.from_parts(place.tolist(), (1.0, 0.0, 0.0, 0.0))
    return pose @ moved @ Pose.exp([0.0, 0.0, 0.0, *turn.tolist()])


def _warped(mask: Mask, off_px: float, random: np.random.Generator) -> Mask:
    """Shift each pixel by smooth noise with a standard deviation of `off_px` along both axes."""
    height, width = mask.shape
    rows, columns = np.mgrid[:height, :width]
    down, right = (off_px * _smooth((height, width), random) for _ in range(2))
    v = np.clip(np.rint(rows + down), 0, height - 1).astype(int)
    u = np.clip(np.rint(columns + right), 0, width - 1).astype(int)
    return mask[v, u]


def _smooth(shape: tuple[int, int], random: np.random.Generator) -> Floats:
    """Return smooth noise (H, W) of standard deviation 1 everywhere."""
    height, width = shape
    grid = random.normal(size=(height // _LUMP_PX + 2, width // _LUMP_PX + 2))
    down, right = (_weights(length, _LUMP_PX) for length in shape)
    return down @ grid[: down.shape[1], : right.shape[1]] @ right.T


def _weights(length: int, step: int) -> Floats:
    """Return the weights of `length` pixels on marks `step` apart; their squares sum to 1."""
    places = np.arange(length)[:, None] / step - np.arange(length // step + 2)[None]
    weights = np.maximum(1.0 - np.abs(places), 0.0)
    return weights / np.linalg.norm(weights, axis=1, keepdims=True)


def _with_holes(mask: Mask, share: float, random: np.random.Generator) -> Mask:
    """Punch discs into the object until `share` of it is missing."""
    inside = np.argwhere(mask > 0)
    radius = _HOLE * np.sqrt(len(inside))
    rows, columns = np.mgrid[: mask.shape[0], : mask.shape[1]]
    kept = mask > 0
    while np.count_nonzero(kept) > (1.0 - share) * len(inside):
        v, u = inside[random.integers(len(inside))]
        kept &= (rows - v) ** 2 + (columns - u) ** 2 > radius**2
    return np.where(kept, np.uint8(255), np.uint8(0))

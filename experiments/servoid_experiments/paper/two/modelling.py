"""Section 5.2, Fig. 9: models an object of two ellipsoids with three."""

import time
from collections.abc import Sequence
from enum import Enum
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from servoid._native import (
    Body,
    ModelInput,
    ModelSettings,
    PaperSettings,
    Pose,
    View,
    fit_body,
    fit_paper,
    silhouette_ious,
)
from servoid.batch import Experiment
from servoid.model import RangeSamples
from servoid.model.range_samples import NO_RANGE_SAMPLES, range_samples_of_depth
from servoid.segment.hue import hue_window, match_image
from servoid.stereo import stereo_depth
from servoid_experiments.design import about
from servoid_experiments.metrics import centroid, nearest_parts, shape_matrices, volume_iou
from servoid_experiments.paper.eye_pair import (
    EyePair,
    Moment,
    PairSettings,
    Triple,
    paper_hand,
    see,
    true_body,
)
from servoid_experiments.stage import EyeMode

OBJECT_NAME = "two_ellipsoids"
_SURE = 0.008  # largest expected error of a measured depth, as a share of it


class Procedure(Enum):
    """A way to model: the inputs and the method."""

    PAPER = "paper"
    PAIR = "pair"
    STEREO = "stereo"
    DEPTH = "depth"
    LOOKS = "looks"


class TwoTrial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the object is seen and modelled."""

    pair: PairSettings = PairSettings(samples=1, background="plain")
    eyes: Annotated[EyeMode, about("where the eyes look; assumed")] = EyeMode.VERGED
    place: Annotated[
        Triple, about("of the object in the hand's frame, m; as in Sec. 5.1, assumed")
    ] = (0.0, -0.1, 0.53)
    spread: Annotated[float, about("how far off it lies at random along each axis, m", ge=0.0)] = (
        0.03
    )
    ellipsoids: Annotated[int, about("of the model; the paper's", ge=1)] = 3
    points: Annotated[int, about("m, on a surface; assumed", ge=1)] = 500
    alpha: Annotated[
        float,
        about("margin of the envelope, share of the least radius; assumed", gt=0.0),
    ] = 0.3
    population: Annotated[int, about("individuals; assumed", ge=8)] = 100
    generations: Annotated[int, about("for each ellipsoid; assumed", ge=1)] = 300
    depth_noise: Annotated[
        float, about("of a depth camera, share of the depth; assumed", ge=0.0)
    ] = 0.005
    looks_deg: Annotated[
        tuple[tuple[float, float], ...],
        about("further places to look from, turned about the object to the right and up"),
    ] = ((55.0, 0.0), (-55.0, 0.0), (0.0, 45.0))


class TwoCase(msgspec.Struct, frozen=True, kw_only=True):
    """One model of one stereo pair; the seed sets noise, light, position and search."""

    procedure: Procedure
    seed: int
    trial: TwoTrial


class TwoRow(msgspec.Struct, frozen=True, kw_only=True):
    """A model and its errors, in m, in the frame of the hand at its first position.

    `error` is that of the centroid. `part_errors` are those of the centre nearest to each true
    ellipsoid's, and `radius_errors` those of that ellipsoid's radii, the longest first.
    `volume_ratio` is the model's volume divided by the true one. `seen_points` is the number of
    surface points from depth. `centers`, `radii` and `rotations` (w, x, y, z) are the model's.
    Seconds are not reproducible.
    """

    error: list[float]
    volume_iou: float
    silhouette_iou: float
    volume_ratio: float
    part_errors: list[list[float]]
    radius_errors: list[list[float]]
    seen_points: int
    centers: list[list[float]]
    radii: list[list[float]]
    rotations: list[list[float]]
    seconds: float


def run_two_ellipsoids(case: TwoCase) -> TwoRow:
    """Render a stereo pair, model the object, and compare the model with the truth."""
    pair = first_pair(case)
    window = hue_window(pair.images[0], pair.masks[0])
    pairs = [pair, *_further_pairs(case)] if case.procedure is Procedure.LOOKS else [pair]
    # All procedures start from the pixels with the target's hue.
    masks = [[match_image(image, *window) for image in one.images] for one in pairs]
    views = [view for one, own in zip(pairs, masks, strict=True) for view in one.views(own)]
    samples = _range_samples(case, pair, masks[0][0])
    start = time.perf_counter()
    body = _model(case, views, samples)
    seconds = time.perf_counter() - start
    return _row(body, pair, len(samples), seconds)


TWO_ELLIPSOIDS = Experiment("two_ellipsoids", run_two_ellipsoids, TwoCase, TwoRow)


def first_pair(case: TwoCase) -> EyePair:
    """Render what the eyes see from the hand's first position."""
    return _pair_from(case, paper_hand(), 0)


def _further_pairs(case: TwoCase) -> list[EyePair]:
    """Render what the eyes see after the hand has moved around the object.

    Whether an arm can reach these poses is not checked.
    """
    middle = _hand_from_object(case)
    pairs = []
    for number, (right, up) in enumerate(case.trial.looks_deg, start=1):
        aside = Pose.exp([0.0, 0.0, 0.0, 0.0, -np.radians(right), 0.0])
        above = Pose.exp([0.0, 0.0, 0.0, -np.radians(up), 0.0, 0.0])
        hand = paper_hand() @ middle @ aside @ above @ middle.inverse()
        pairs.append(_pair_from(case, hand, number))
    return pairs


def _hand_from_object(case: TwoCase) -> Pose:
    """Return the object's pose relative to the hand at its first position."""
    random = np.random.default_rng([case.seed, 0])
    place = np.array(case.trial.place) + random.uniform(-1.0, 1.0, 3) * case.trial.spread
    return Pose.from_parts(place.tolist(), [1.0, 0.0, 0.0, 0.0])


def _pair_from(case: TwoCase, world_from_hand: Pose, number: int) -> EyePair:
    world_from_object = paper_hand() @ _hand_from_object(case)
    moment = Moment(
        OBJECT_NAME,
        world_from_hand.inverse() @ world_from_object,
        world_from_hand,
        case.trial.eyes,
        seed=100 * case.seed + number,
    )
    return see(case.trial.pair, moment.lit(np.random.default_rng([case.seed, 1])))


def _range_samples(case: TwoCase, pair: EyePair, mask: NDArray[np.uint8]) -> RangeSamples:
    """Return the range samples of the left image's object that the procedure has."""
    if case.procedure is Procedure.STEREO:
        left_from_right = pair.world_from_cameras[0].inverse() @ pair.world_from_cameras[1]
        found = stereo_depth(*pair.images, *pair.cameras, left_from_right, mask_a=mask)
        sure = found.sigma_m <= _SURE * found.depth
        depth = np.where(sure, found.depth, np.float32(np.nan)).astype(np.float32)
    elif case.procedure is Procedure.DEPTH:
        random = np.random.default_rng([case.seed, 2])
        true = pair.depths[0]
        noise = case.trial.depth_noise * random.normal(size=true.shape)
        depth = np.where(pair.masks[0] != 0, true * (1.0 + noise), np.nan).astype(np.float32)
    else:
        return NO_RANGE_SAMPLES
    return range_samples_of_depth(depth, mask, pair.cameras[0], pair.world_from_cameras[0])


def _model(case: TwoCase, views: Sequence[View], samples: RangeSamples) -> Body:
    """Model with the requested number of ellipsoids, on one thread."""
    trial = case.trial
    if case.procedure is Procedure.PAPER:
        settings = PaperSettings(
            max_ellipsoids=trial.ellipsoids,
            delta=0.0,
            seed=case.seed,
            threads=1,
            points=trial.points,
            alpha=trial.alpha,
            population=trial.population,
            generations=trial.generations,
        )
        return fit_paper(views, settings)[-1].body
    given = ModelInput(views=views, points=samples.points, directions=samples.directions)
    settings = ModelSettings(max_ellipsoids=trial.ellipsoids, delta=0.0, seed=case.seed, threads=1)
    return fit_body(given, settings)[-1].body


def _row(body: Body, pair: EyePair, seen_points: int, seconds: float) -> TwoRow:
    true = true_body(OBJECT_NAME, pair.world_from_object)
    to_hand = paper_hand().inverse()
    in_hand = to_hand.matrix()[:3, :3]
    found, there = shape_matrices(body)[0], shape_matrices(true)[0]
    parts = nearest_parts(body, true)
    radii = -np.sort(-body.radii, axis=1)
    true_radii = -np.sort(-true.radii, axis=1)
    world = [
        body.world_from_object @ Pose.from_parts([0, 0, 0], q.tolist()) for q in body.rotations
    ]
    return TwoRow(
        error=(in_hand @ (centroid(body) - centroid(true))).tolist(),
        volume_iou=volume_iou(body, true),
        silhouette_iou=float(silhouette_ious(body, pair.views(pair.masks)).mean()),
        volume_ratio=float(body.mass_properties()[0] / true.mass_properties()[0]),
        part_errors=((found[parts] - there) @ in_hand.T).tolist(),
        radius_errors=(radii[parts] - true_radii).tolist(),
        seen_points=seen_points,
        centers=to_hand.transform(np.ascontiguousarray(found)).tolist(),
        radii=body.radii.tolist(),
        rotations=[list((to_hand @ pose).quaternion) for pose in world],
        seconds=seconds,
    )

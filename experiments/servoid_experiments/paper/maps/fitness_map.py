"""Section 5.1, Fig. 8: the fitness of poses around the true one, by each fitness function."""

import time
from collections.abc import Callable

import numpy as np

from servoid._native import PaperSettings, Pose, Tracker, TrackSettings, View, paper_scores
from servoid.batch import Experiment
from servoid.errors import MaskError
from servoid.pose.exact import Floats
from servoid.segment.hue import hue_window, match_image
from servoid_experiments.paper.eye_pair import EyePair, Moment, paper_hand, see, true_body
from servoid_experiments.paper.maps.case import (
    Answer,
    Fitness,
    FitnessRow,
    MapCase,
    MapRow,
    Ridge,
)
from servoid_experiments.paper.maps.places import Places, peak_of, width_at_share

FINEST, COARSEST = 0, 2  # resolutions of the surface points
_BESIDE = 0.005  # along each axis: the offset at which servoid starts its search
_ANSWERING = (Fitness.REGION, Fitness.SURFACE, Fitness.FULL)
Scores = dict[Fitness, Floats]


def run_fitness_map(case: MapCase) -> MapRow:
    """Render a stereo pair and score poses around the truth with each fitness.

    The surface's appearance is learned in another pair, with the object at another pose.
    """
    taught = _seen(case, _taught_pose(case), 1)
    pair = _seen(case, Pose.from_parts(case.trial.place, [1.0, 0.0, 0.0, 0.0]), 0)
    tracker = _taught(case, taught)
    score = _scorer(case, taught, pair, tracker)
    places = Places(case.trial)
    whole = score(places.box(), coarse=False) if case.whole else {}
    along = [score(line) for line in places.lines]
    crest, peak = score(places.crest), score(places.peak)
    seconds = _seconds(case, taught, pair, places) if case.whole else (None, None)
    return MapRow(
        fitnesses=[
            _fitness_row(one, places, whole.get(one), [line[one] for line in along], crest, peak)
            for one in Fitness
        ],
        answers=[_answer(case, one, taught, pair) for one in _ANSWERING],
        depths=(places.steps[2] - case.trial.place[2]).tolist() if case.whole else [],
        crest_depths=(places.crest_depths - case.trial.place[2]).tolist() if case.whole else [],
        surface_points=len(tracker.surface[0]),
        points_seconds=seconds[0],
        region_seconds=seconds[1],
    )


FITNESS_MAP = Experiment("fitness_map", run_fitness_map, MapCase, MapRow)


def _seen(case: MapCase, hand_from_object: Pose, number: int) -> EyePair:
    """Render a pair; from the second seed on, the light differs, too."""
    moment = Moment(
        case.object_name, hand_from_object, paper_hand(), case.eyes, seed=2 * case.seed + number
    )
    random = np.random.default_rng([case.seed, number])
    return see(case.trial.pair, moment.lit(random) if case.seed else moment)


def _taught_pose(case: MapCase) -> Pose:
    random = np.random.default_rng(case.seed)
    way, axis = random.normal(size=3), random.normal(size=3)
    shift = case.trial.taught_shift * way / np.linalg.norm(way)
    turn = np.radians(case.trial.taught_turn_deg) * axis / np.linalg.norm(axis)
    place = np.array(case.trial.place) + shift
    return Pose.from_parts(place.tolist(), Pose.exp([0.0, 0.0, 0.0, *turn.tolist()]).quaternion)


def _taught(case: MapCase, pair: EyePair, by: Fitness = Fitness.FULL) -> Tracker:
    """Return a tracker that learned the object's appearance, by one kind of evidence or both."""
    body = true_body(case.object_name, pair.world_from_object)
    settings = TrackSettings(
        seed=case.seed,
        local_colors=False,
        region=by is not Fitness.SURFACE,
        surface=by is not Fitness.REGION,
    )
    tracker = Tracker(pair.cameras, body, settings)
    tracker.start(0.0, pair.world_from_cameras, pair.images, pair.world_from_object, pair.masks)
    return tracker


def _matches(taught: EyePair, pair: EyePair) -> list[View]:
    """Return which pixels match the hue window; for an object of several hues, the true mask."""
    try:
        window = hue_window(taught.images[0], taught.masks[0])
        masks = [match_image(image, *window) for image in pair.images]
    except MaskError:
        masks = list(pair.masks)
    return pair.views(masks)


def _scorer(
    case: MapCase, taught: EyePair, pair: EyePair, tracker: Tracker
) -> Callable[..., Scores]:
    """Return a function that scores positions (N, 3) in the hand's frame with every fitness."""
    views = _matches(taught, pair)
    body = true_body(case.object_name, pair.world_from_object)
    settings = _paper_settings(case)

    def score(places: Floats, *, coarse: bool = True) -> Scores:
        poses = _poses(places)
        eyes, images = pair.world_from_cameras, pair.images
        fine = tracker.score_terms(1.0, eyes, images, poses, resolution=FINEST, threads=1)
        found = {
            Fitness.POINTS: paper_scores(views, body, poses, settings),
            Fitness.REGION: fine[:, 0],
            Fitness.SURFACE: fine[:, 1],
            Fitness.FULL: fine.sum(axis=1),
        }
        if coarse:
            found[Fitness.COARSE] = tracker.score_terms(
                1.0, eyes, images, poses, resolution=COARSEST, threads=1
            ).sum(axis=1)
        return found

    return score


def _paper_settings(case: MapCase) -> PaperSettings:
    return PaperSettings(points=case.trial.points, alpha=case.trial.alpha, threads=1)


def _poses(places: Floats) -> Floats:
    """Convert positions in the hand's frame to poses (N, 7) in the world, rotated like the hand."""
    hand = paper_hand()
    turns = np.tile(hand.quaternion, (len(places), 1))
    return np.hstack([turns, hand.transform(np.ascontiguousarray(places))])


def _fitness_row(
    fitness: Fitness,
    places: Places,
    whole: Floats | None,
    along: list[Floats],
    crest: Scores,
    peak: Scores,
) -> FitnessRow:
    ridge_line = crest[fitness].reshape(len(places.crest_depths), -1).max(axis=1)
    floor = None if whole is None else float(whole.min())
    near = peak[fitness]
    depths = near.reshape(len(places.peak_depths), -1).max(axis=1)
    best = places.peak[int(near.argmax())] - places.truth
    ridge = Ridge(
        along=[
            width_at_share(steps, line) for steps, line in zip(places.steps, along, strict=True)
        ],
        crest=width_at_share(places.crest_depths, ridge_line),
        crest_from_floor=None
        if floor is None
        else width_at_share(places.crest_depths, ridge_line, floor),
        peak=[
            float(best[0]),
            float(best[1]),
            peak_of(places.peak_depths, depths) - float(places.truth[2]),
        ],
        height=float(near.max()),
    )
    if whole is None:
        return FitnessRow(fitness=fitness, ridge=ridge)
    box = whole.reshape([len(axis) for axis in places.axes])
    top = np.unravel_index(int(box.argmax()), box.shape)
    where = np.array([axis[at] for axis, at in zip(places.axes, top, strict=True)])
    return FitnessRow(
        fitness=fitness,
        ridge=ridge,
        floor=floor,
        map_peak=(where - places.truth).tolist(),
        xy=box.max(axis=2).T.tolist(),
        yz=box.max(axis=0).T.tolist(),
        xz=box.max(axis=1).T.tolist(),
        along_z=along[2].tolist(),
        crest=ridge_line.tolist(),
    )


def _seconds(case: MapCase, taught: EyePair, pair: EyePair, places: Places) -> tuple[float, float]:
    """Measure the time for the box with the points and with the region, on one thread."""
    poses = _poses(places.box())
    region = _taught(case, taught, Fitness.REGION)
    views = _matches(taught, pair)
    body = true_body(case.object_name, pair.world_from_object)
    start = time.perf_counter()
    paper_scores(views, body, poses, _paper_settings(case))
    between = time.perf_counter()
    region.score_terms(1.0, pair.world_from_cameras, pair.images, poses, threads=1)
    return between - start, time.perf_counter() - between


def _answer(case: MapCase, by: Fitness, taught: EyePair, pair: EyePair) -> Answer:
    """Return the estimate of servoid's tracker, started a few millimetres from the truth."""
    near = paper_hand() @ Pose.from_parts(
        np.add(case.trial.place, _BESIDE).tolist(), [1.0, 0.0, 0.0, 0.0]
    )
    tracker = _taught(case, taught, by)
    found = tracker.find(1.0, pair.world_from_cameras, pair.images, near)
    if found.status != "tracking":
        return Answer(fitness=by)
    in_hand = paper_hand().inverse() @ found.world_from_object
    held = np.linalg.inv(np.linalg.inv(found.covariance)[:3, :3])
    return Answer(
        fitness=by,
        error=np.subtract(in_hand.translation, case.trial.place).tolist(),
        sigma_z=float(np.sqrt(held[2, 2])),
    )

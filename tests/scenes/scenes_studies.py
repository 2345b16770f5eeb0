"""Studies of the paper, in small, and what they find by chance."""

from pathlib import Path

import numpy as np
from msgspec.structs import replace
from scene_table import Figures, scene

from servoid._native import PaperSettings, Pose, Tracker, TrackSettings, View, paper_scores
from servoid_experiments.paper.eye_pair import (
    EyePair,
    Moment,
    PairSettings,
    paper_hand,
    see,
    true_body,
)
from servoid_experiments.paper.servoing.method import Method, TrackerKind
from servoid_experiments.paper.servoing.runs import quick_servoing
from servoid_experiments.paper.servoing.settings import with_constant
from servoid_experiments.paper.servoing.trial import ServoingCase, run_servoing
from servoid_experiments.paper.two.modelling import Procedure, TwoRow
from servoid_experiments.paper.two.report import QUICK_TWO, two_work
from servoid_experiments.stage import EyeMode

COARSE = with_constant(quick_servoing().constants, "scene.amplitude", 0.04)
SHORT = ServoingCase(name="short", seed=3, omega=4.0, settle_s=0.3, periods=1, constants=COARSE)
FED = Method(tracker=TrackerKind.SERVOID, stamped=True, filtered=True, feed_forward=True, qp=True)

SMALL = PairSettings(size_px=(320, 240), samples=1, background="plain")
BEFORE_HAND = Pose.from_parts([0.0, -0.1, 0.53], [1.0, 0.0, 0.0, 0.0])

TWO = replace(QUICK_TWO, procedures=tuple(Procedure), seeds=1)


@scene("paper fed forward", {"lag left": "1"}, {"lag": "deg"})
def paper_fed_forward(seed: int, _folder: Path) -> Figures:
    slower = replace(SHORT, seed=seed, omega=1.5, settle_s=1.0)
    ahead = replace(slower, method=FED)
    paper, best = (run_servoing(case).followed.hand_lag_deg for case in (slower, ahead))
    return {"lag": paper, "lag left": abs(best) / paper}


def two_figures(rows: dict[Procedure, TwoRow]) -> Figures:
    """Compare the models that each procedure makes of two ellipsoids."""
    well = [rows[one] for one in (Procedure.DEPTH, Procedure.LOOKS)]
    worse = max(1.0 - row.volume_iou for row in well)
    return {
        "outline missed by pair": 1.0 - rows[Procedure.PAIR].silhouette_iou,
        "volume missed by pair": 1.0 - rows[Procedure.PAIR].volume_iou,
        "volume missed": worse,
        "missed by paper": worse / (1.0 - rows[Procedure.PAPER].volume_iou),
        "centre off": 1e3 * max(float(np.linalg.norm(row.error)) for row in well),
        "part off": 1e3 * max(float(np.abs(row.part_errors).max()) for row in well),
    }


@scene(
    "paper two ellipsoids",
    {
        "outline missed by pair": "1",
        "volume missed": "1",
        "missed by paper": "1",
        "centre off": "mm",
        "part off": "mm",
    },
    {"volume missed by pair": "1"},
)
def paper_two(seed: int, _folder: Path) -> Figures:
    work = two_work(TWO)
    cases = [replace(case, seed=seed) for case in work.cases]
    return two_figures({case.procedure: work.experiment.run(case) for case in cases})


def eye_pair(seed: int) -> EyePair:
    """Return a stereo pair of the patterned egg."""
    return see(SMALL, Moment("painted_ellipsoid", BEFORE_HAND, paper_hand(), EyeMode.VERGED, seed))


def poses_around(pair: EyePair, seed: int = 0) -> np.ndarray:
    """Return poses (N, 7) of the object in the world, the true one first."""
    random = np.random.default_rng(seed)
    off = np.vstack([np.zeros(3), random.uniform(-0.05, 0.05, (999, 3))])
    turn = np.tile(pair.world_from_object.quaternion, (len(off), 1))
    return np.hstack([turn, np.array(pair.world_from_object.translation) + off])


def matches(pair: EyePair) -> list[View]:
    """Return the true masks as match images."""
    eyes = zip(pair.cameras, pair.world_from_cameras, pair.masks, strict=True)
    return [View(camera=one, world_from_camera=pose, mask=mask) for one, pose, mask in eyes]


def tracker_of(pair: EyePair) -> Tracker:
    """Return a tracker that learned the object's look in the pair."""
    tracker = Tracker(
        pair.cameras, true_body("painted_ellipsoid", pair.world_from_object), TrackSettings()
    )
    tracker.start(0.0, pair.world_from_cameras, pair.images, pair.world_from_object, pair.masks)
    return tracker


def highest_off(pair: EyePair, poses: np.ndarray) -> float:
    """Return how far from where the object is any fitness is highest, in metres."""
    body = true_body("painted_ellipsoid", pair.world_from_object)
    points = paper_scores(matches(pair), body, poses, PaperSettings())
    score_terms = tracker_of(pair).score_terms(1.0, pair.world_from_cameras, pair.images, poses)
    off = [
        np.linalg.norm(poses[int(values.argmax()), 4:] - poses[0, 4:])
        for values in (points, score_terms[:, 0], score_terms[:, 1], score_terms.sum(axis=1))
    ]
    return float(max(off))

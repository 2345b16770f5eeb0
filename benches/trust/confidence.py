"""Fit the weights of a pose's evidence, so that its confidence is the probability of being right.

Tracks the recordings beside the repository, unchanged and made harder, and courses that the tests
draw, some of them slow. Records in each image the evidence of the pose and whether it is right, and
fits the weights of the log-odds by maximum likelihood, with the factors of drift and of proof as
they are; each sequence counts equally. Prints the weights
for `crates/servoid/src/track/pose/confidence.rs`, and by steps of the probability how many poses
are right, where each sequence is predicted with weights that were fitted without it.

Run it with: python benches/trust/confidence.py [--seeds N] [SEQUENCE ...]
"""

import argparse
import sys
import tempfile
from ast import literal_eval
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import erf, expit

from servoid.cli.progress import progress_bar
from servoid.exchange import open_any
from servoid.pose.exact import Floats
from servoid.track import Request, track_capture

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / part)
    for part in ("benches/track", "tests/fixtures", "tests/scenes", "tests/house")
)

from rust_constants import constants
from trust_scenes import (
    ALL_COURSES,
    FULL,
    MESHES,
    PLAIN,
    PRINTED,
    SMALL,
    TOY_COURSES,
    Course,
    write_course,
)
from trust_variants import VARIANTS
from trust_verdicts import verdicts

from sequences import HARD, MONO, REAL, SHARED, STEREO, Recording, Table

SEEDS = 2  # of each drawn course
HARDER = ("as it is", "noise", "half size", "dark")
PENALTY = 1e-3  # of the weights' squares
TERMS = ("one", "SHARE", "TEXTURED", "REFERENCE", "PROVED", "TURN", "JITTER")
EDGES = np.linspace(0.0, 1.0, 11)
BOUNDS: dict[str, tuple[float, ...]] = {
    one.name: tuple(np.atleast_1d(literal_eval(one.value)).tolist())
    for one in constants()
    if one.file == "pose/confidence.rs"
}
MOST = 1.0 - 1e-9  # the greatest probability

# A sequence, the evidence of its poses, their factors, and which are right.
Sample = tuple[str, Floats, Floats, Floats]


def slowly(index: int) -> float:
    """Return the angle in degrees by which a slowly turning object has turned."""
    return 0.8 * max(index - 3, 0)


COURSES_TOO = {
    "slow plain": Course(PLAIN, 70, 3.0, turned_deg=slowly),
    "slow printed": Course(PRINTED, 70, 3.0, turned_deg=slowly),
}


def terms(evidence: dict[str, float]) -> list[float]:
    """Return the weighted terms: the ramps and logarithms of confidence.rs, with its bounds."""
    (many, part, _), (first, last, _) = BOUNDS["TEXTURED"], BOUNDS["REFERENCE"]
    reference = (evidence["reference_textured"] - first) / (last - first)

    def spread(rad: float, name: str) -> float:
        none, least, most, _ = BOUNDS[name]
        return -float(np.log(np.clip(rad, least, most) / none))

    return [
        1.0,
        evidence["share"],
        float(
            evidence["textured"] >= many
            and evidence["textured"] * evidence["share"] >= part * evidence["recognised"]
        ),
        float(np.clip(reference, 0.0, 1.0)),
        evidence["proved"],
        spread(evidence["turn_rad"], "TURN"),
        spread(evidence["jitter_rad"], "JITTER"),
    ]


def factor(evidence: dict[str, float]) -> float:
    """Return the probability that the rotation did not drift, nor is that of another pose."""
    (most_rad,), (first, last, least) = BOUNDS["MOST_RAD"], BOUNDS["SAME_POSE"]
    drift = max(evidence["drift_rad"], 1e-9)
    same = float(np.clip((evidence["share"] - first) / (last - first), least, 1.0))
    return float(erf(most_rad / (np.sqrt(2.0) * drift))) * (1.0 if evidence["proved"] else same)


def probabilities(features: Floats, factors: Floats, given: Floats) -> Floats:
    """Return the probability that each pose is right, with the given weights."""
    return np.minimum(factors * expit(features @ given), MOST)


def runs(
    folder: Path, seeds: int, starts: tuple[str, ...]
) -> Iterator[tuple[str, Recording, str, int]]:
    """Name the sequences that begin with the given words, with their variants and seeds."""
    for name in (*STEREO, *MONO, *HARD, *REAL):
        place = SHARED / "data" / name
        if not place.name.startswith(starts):
            continue
        if not place.is_dir():
            print(f"{place.name} skipped: not in shared/data beside the repository")
            continue
        recording = Recording(place.name, place, open_any(place))
        for variant in HARDER:
            yield place.name, recording, variant, 0
    ALL_COURSES.update(COURSES_TOO)
    for name in (one for one in ALL_COURSES if one.startswith(starts)):
        if name in TOY_COURSES and not MESHES.is_dir():
            print(f"{name} skipped: no meshes in shared/data beside the repository")
            continue
        for seed in range(max(seeds, len(ALL_COURSES[name].objects))):
            for size in (SMALL, FULL):
                place = folder / f"{name} {seed} {size[0]}"
                write_course(place, name, seed, size)
                yield place.name, Recording(name, place, open_any(place)), HARDER[0], seed


def sample(recording: Recording, variant: str, seed: int) -> tuple[Floats, Floats, Floats]:
    """Track an object; return its evidence (N, 7), the factors (N,), and which are right (N,)."""
    changed = VARIANTS[variant]
    request = Request(seed=seed, every=changed.every, distance_m=recording.distance_m)
    with tempfile.TemporaryDirectory() as folder:
        capture = changed.change(recording.capture, seed, Path(folder))
        result = track_capture(capture, None, request)[0]
    scaled = len(capture.cameras) == 1
    found = verdicts(result.tracked, recording.true_poses, recording.vertices, scaled=scaled)
    evidence_by_index = {one.index: one.estimate.evidence for one in result.tracked}
    rows = [
        (terms(evidence), factor(evidence), not wrong)
        for index, wrong in zip(found.index, found.wrong, strict=True)
        if (evidence := evidence_by_index[int(index)]) is not None
    ]
    features = np.array([row[0] for row in rows]).reshape(-1, len(TERMS))
    factors, right = (np.array([row[part] for row in rows], float) for part in (1, 2))
    return features, factors, right


def weights(samples: list[Sample]) -> Floats:
    """Return the maximum-likelihood weights, by sequences."""
    images = {name: sum(len(one[3]) for one in samples if one[0] == name) for name, *_ in samples}
    features, factors, right = (
        np.concatenate([one[part] for one in samples]) for part in (1, 2, 3)
    )
    each = np.concatenate([np.full(len(one[3]), 1.0 / images[one[0]]) for one in samples])
    each /= each.sum()

    def loss(given: Floats) -> tuple[float, Floats]:
        share = expit(features @ given)
        found = probabilities(features, factors, given)
        surprise = -np.where(right > 0.0, np.log(np.maximum(found, 1e-300)), np.log1p(-found))
        missed = (1.0 - share) * np.where(right > 0.0, -1.0, found / (1.0 - found))
        free = np.r_[0.0, given[1:]]
        value = each @ surprise + PENALTY * free @ free
        return float(value), features.T @ (each * missed) + 2.0 * PENALTY * free

    return np.asarray(minimize(loss, np.zeros(len(TERMS)), jac=True).x)


def print_weights(samples: list[Sample]) -> None:
    """Print the weights, and their results on sequences that were left out."""
    if not samples:
        print("nothing to track: no sequence begins so")
        return
    found = weights(samples)
    print("weights:", ", ".join(f"{n} {w:.2f}" for n, w in zip(TERMS, found, strict=True)))
    names = list(dict.fromkeys(one[0] for one in samples))
    if len(names) < 2:
        print("one sequence cannot be foretold by others; give two or more")
        return
    predicted, right = [], []
    for name in names:
        own = weights([one for one in samples if one[0] != name])
        for _, features, factors, truth in (one for one in samples if one[0] == name):
            predicted.append(probabilities(features, factors, own))
            right.append(truth)
    likely, truth = np.concatenate(predicted), np.concatenate(right)
    table = Table("probability", "images", "mean %", "right %")
    for low, high in pairwise(EDGES):
        chosen = (likely >= low) & ((likely < high) | (high == 1.0))
        if chosen.any():
            shares = 100.0 * likely[chosen].mean(), 100.0 * truth[chosen].mean()
            table.row(f"{low:.1f} - {high:.1f}", int(chosen.sum()), *shares)


def main() -> None:
    """Track, fit the weights, and print them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("sequence", nargs="*", help="the beginning of a sequence's name")
    parser.add_argument(
        "--seeds",
        type=int,
        default=SEEDS,
        help=f"of each course, or one for each of its objects if that is more (default {SEEDS})",
    )
    given = parser.parse_args()
    starts = tuple(given.sequence) or ("",)
    samples: list[Sample] = []
    with tempfile.TemporaryDirectory() as folder, progress_bar("tracking") as update:
        chosen = list(runs(Path(folder), given.seeds, starts))
        for number, (name, recording, variant, seed) in enumerate(chosen):
            update(number / len(chosen), f"{name}, {variant}")
            samples.append((name, *sample(recording, variant, seed)))
    print_weights(samples)


if __name__ == "__main__":
    main()

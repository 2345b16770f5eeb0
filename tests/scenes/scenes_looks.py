"""Objects that are modelled from one look at them, and how far off the models are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from body_measures import WorldBody
from drawn_pairs import BASELINE, RADII, Pair
from scene_table import Figures, Scene, scene

from servoid.capture import Capture, open_capture
from servoid.model import (
    ModelResult,
    Request,
    fit_capture,
    fit_capture_by_paper,
    mark_everywhere,
)
from servoid.segment import BoxTarget
from servoid.shape import BodyFile, load_body

PLACE = np.array([0.012, -0.008, 0.42])
POSTERS = (
    (0.04, -0.06, 0.14, 0.04),
    (-0.02, -0.08, 0.25, 0.0),
    (-0.3, -0.05, 0.0, 0.03),
)
TWO = Request(max_ellipsoids=2, delta=0.0)
MEAN = {"surface off": "mm"}


def left_only(path: Path) -> Capture:
    capture = open_capture(path)
    return Capture(
        capture.path, capture.cameras[:1], capture.world_from_rig, capture.times_s, rate_hz=10.0
    )


def fit_pair(folder: Path, seed: int | None = None) -> ModelResult:
    return fit_capture(open_capture(folder), replace(TWO, seed=seed))


def saved(result: ModelResult, folder: Path) -> BodyFile:
    result.save(folder / "body.json")
    return load_body(folder / "body.json")


def errors_m(file: BodyFile, pair: Pair) -> np.ndarray:
    """Return how far the true surface that is seen is from the body's."""
    return WorldBody.of(file).distances(pair.seen_points())


def missed(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of two masks together that they do not have in common."""
    return 1.0 - float((one & other).sum() / (one | other).sum())


def seen_figures(file: BodyFile, pair: Pair) -> Figures:
    """Say how far the seen surface is off, and what is told of the side that is not seen."""
    errors, seen = errors_m(file, pair), file.seen
    assert seen is not None and seen.unseen_toward is not None
    toward = WorldBody.of(file).world_from_object @ seen.unseen_toward
    cosine = float(toward @ pair.world_from_left[:3, 2])
    return {
        "surface off": 1e3 * float(errors.mean()),
        "surface off at most": 1e3 * float(np.quantile(errors, 0.98)),
        "share off half": abs(seen.share - 0.5),
        "unseen off": float(np.degrees(np.arccos(min(1.0, cosine)))),
    }


SEEN = {**MEAN, "surface off at most": "mm", "share off half": "1", "unseen off": "deg"}


@scene("look at a pair", SEEN)
def look_at_pair(seed: int, folder: Path) -> Figures:
    result = fit_pair(Pair().write(folder / "pair"), seed)
    return seen_figures(saved(result, folder), Pair())


@scene("look by one depth camera", SEEN)
def look_by_depth_camera(seed: int, folder: Path) -> Figures:
    path = Pair().write(folder / "alone", cameras=1, depths=True)
    return seen_figures(saved(fit_pair(path, seed), folder), Pair())


def poster_figures(pair: Pair, result: ModelResult, folder: Path) -> Figures:
    """Say how far a poster in the object's colour leads mask and body astray."""
    found = {view.camera_name: view.mask() != 0 for view in result.used_views}
    file = saved(result, folder)
    away = Pair().to_left(WorldBody.of(file).centers) - pair.centers[0]
    return {
        "mask missed": missed(found["right"], pair.draw(0, BASELINE)[2]),
        "centre away": 1e3 * float(np.linalg.norm(away, axis=1).max()),
        "surface off": 1e3 * float(errors_m(file, pair).mean()),
    }


def _before(number: int) -> Scene:
    pair = Pair(poster=POSTERS[number])

    @scene(f"look before poster {number}", {**MEAN, "mask missed": "1", "centre away": "mm"})
    def before(seed: int, folder: Path) -> Figures:
        return poster_figures(pair, fit_pair(pair.write(folder / "pair"), seed), folder)

    return before


BEFORE_POSTER = [_before(number) for number in range(len(POSTERS))]


def box_around(mask: np.ndarray, view: str) -> BoxTarget:
    """Draw a box 4 pixels larger than a mask on each side."""
    rows, columns = np.nonzero(mask)
    corners = (columns.min() - 4, rows.min() - 4, columns.max() + 4, rows.max() + 4)
    return BoxTarget(*map(float, corners), view=view)


def fit_in_box(pair: Pair, folder: Path, seed: int | None = None) -> ModelResult:
    capture = open_capture(folder)
    box = box_around(pair.draw(0, 0.0)[2], "left/0000")
    return fit_capture(capture, replace(TWO, seed=seed), targets=[box])


@scene("look in a box", MEAN)
def look_in_box(seed: int, folder: Path) -> Figures:
    pair = Pair()
    result = fit_in_box(pair, pair.write(folder / "pair"), seed)
    return {"surface off": 1e3 * float(errors_m(saved(result, folder), pair).mean())}


def depth_figures(blind: BodyFile, seeing: BodyFile, pair: Pair) -> Figures:
    """Compare a model of a plain object without and with depth images."""
    far, near = (float(errors_m(file, pair).mean()) for file in (blind, seeing))
    return {"surface off": 1e3 * near, "off by blind": near / far}


@scene("look with depth", {**MEAN, "off by blind": "1"})
def look_with_depth(seed: int, folder: Path) -> Figures:
    pair = Pair(patterned=False)
    paths = [pair.write(folder / str(depths), depths=depths) for depths in (False, True)]
    blind, seeing = (saved(fit_pair(path, seed), folder) for path in paths)
    return depth_figures(blind, seeing, pair)


def paper_figures(file: BodyFile) -> Figures:
    """Say how far the paper's method is off across the line of sight."""
    center = Pair().to_left(WorldBody.of(file).centers)[0]
    return {"centre off": 1e3 * float(np.abs(center[:2] - PLACE[:2]).max())}


@scene("look by the paper", {"centre off": "mm"})
def look_by_paper(seed: int, folder: Path) -> Figures:
    path = Pair().write(folder / "pair")
    request = Request(max_ellipsoids=1, delta=0.0, seed=seed)
    return paper_figures(saved(fit_capture_by_paper(open_capture(path), request), folder))


def marked_figures(folder: Path, seed: int) -> Figures:
    """Say how far the masks are off to which the mask of one image leads."""
    marked = mark_everywhere(open_capture(folder), Request(seed=seed))
    views = {view.camera_name: view.mask() > 0 for view in marked}
    both = [
        missed(views[name], Pair().draw(0, offset)[2])
        for name, offset in (("left", 0.0), ("right", BASELINE))
    ]
    return {"mask missed": max(both)}


@scene("look marks all views", {"mask missed": "1"})
def marks_all(seed: int, folder: Path) -> Figures:
    return marked_figures(Pair().write(folder / "pair"), seed)


def alone_figures(result: ModelResult) -> Figures:
    """Say how far a body from one image at a known distance is off."""
    pose = Pair().world_from_left
    place = (np.array(result.body.world_from_object.translation) - pose[:3, 3]) @ pose[:3, :3]
    volume, _, _ = result.body.mass_properties()
    assert result.coverage is not None
    return {
        "place off": 1e3 * float(np.abs(place - PLACE).max()),
        "volume off": abs(volume / (4.0 / 3.0 * np.pi * float(np.prod(RADII))) - 1.0),
        "share": result.coverage.share,
    }


@scene("look with one eye", {"place off": "mm", "volume off": "1", "share": "1"})
def look_with_one_eye(seed: int, folder: Path) -> Figures:
    capture = left_only(Pair().write(folder / "pair"))
    return alone_figures(fit_capture(capture, Request(seed=seed), distance_m=0.42))


def twice_figures(folder: Path, seed: int | None = None) -> Figures:
    """Compare bodies that one image gives at a distance and at twice that distance."""
    near, far = (
        fit_capture(left_only(folder), Request(seed=seed), distance_m=distance_m).body
        for distance_m in (0.4, 0.8)
    )
    ratio = far.mass_properties()[0] / near.mass_properties()[0]
    return {"size off": abs(ratio ** (1.0 / 3.0) / 2.0 - 1.0)}


@scene("look from twice the distance", {"size off": "1"})
def look_from_twice(seed: int, folder: Path) -> Figures:
    return twice_figures(Pair().write(folder / "pair"), seed)

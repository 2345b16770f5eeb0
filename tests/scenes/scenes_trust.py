"""Courses that lead a tracker to be wrongly sure, and how often it is."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from scene_table import Figures, Scene, scene
from tracks_through import tracks_through
from trust_scenes import ALL_COURSES, COURSES, mesh_of, write_course
from trust_verdicts import Verdicts, verdicts

from servoid import model
from servoid.capture import open_capture
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import Body
from servoid.track import Request, Subject
from servoid_experiments.modelling.designs import DESIGNS
from servoid_experiments.tracking.trial import known_of

ELLIPSOIDS = 5
MOST = {"wrong": "%", "wrong in a row": "images"}
LEAST = {"right": "%"}
KNOWN, LOOKED_AT = "known", "looked at"  # a body of many views, or one of the first look


@cache
def _shelf() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


@cache
def drawn_course(name: str, seed: int) -> Path:
    """Draw a course; it stays while the process runs."""
    return write_course(Path(_shelf().name) / f"{name} {seed}", name, seed)


def true_poses(folder: Path) -> list[Pose]:
    """Read where the object of a drawn course truly is, in the capture's world."""
    points = read_trajectory(folder / "truth" / "left_from_object.csv")
    return [point.world_from_object for point in points]


@cache
def known_body(name: str) -> Body:
    """Model an object from views all around it, or from its mesh."""
    if name in DESIGNS:
        return known_of(name, ELLIPSOIDS).body
    return model.fit_mesh(*mesh_of(name), model.Request(max_ellipsoids=ELLIPSOIDS)).body


def followed(
    name: str, how: str, seed: int, folder: Path | None = None, cameras: int = 2
) -> Verdicts:
    """Track the object of a course by the first cameras, and judge the track."""
    folder = drawn_course(name, seed) if folder is None else folder
    course, truth = ALL_COURSES[name], true_poses(folder)
    subject = Subject()
    if how == KNOWN:
        body = known_body(course.object_of(seed))
        start = truth[0] @ body.world_from_object
        subject = Subject(body=body, start=start, known_shape=True)
    capture = open_capture(folder)
    capture = replace(capture, cameras=capture.cameras[:cameras])
    result = tracks_through(capture, [subject], Request(seed=seed))[0]
    return verdicts(result.tracked, truth, course.vertices(seed))


def trust_figures(found: Verdicts) -> Figures:
    """Say how often a track was right, and wrong and said to be tracked."""
    return {
        "wrong": 100.0 * float(np.mean(found.trusted_wrong)),
        "wrong in a row": found.longest_wrong,
        "right": 100.0 * float(np.mean(found.right)),
    }


def trusts_twice(figures: Figures) -> bool:
    """Say whether a wrong pose was said to be tracked in two images in a row."""
    return figures["wrong in a row"] > 1


def _course_scenes(names: Sequence[str]) -> dict[tuple[str, str], Scene]:
    def run(name: str, how: str, seed: int, _folder: Path) -> Figures:
        return trust_figures(followed(name, how, seed))

    return {
        (name, how): scene(f"trust {name}, {how}", MOST, LEAST, trusts_twice)(
            partial(run, name, how)
        )
        for name in names
        for how in (KNOWN, LOOKED_AT)
    }


TRUSTED = _course_scenes(list(COURSES))


def off_figures(found: Verdicts) -> Figures:
    """Say how far nine tenths of the poses are off at most, whatever their status."""
    return {
        "off": 1000.0 * float(np.quantile(found.add, 0.9)),
        "turned": float(np.degrees(np.quantile(found.turn, 0.9))),
        "followed": 100.0 * float(np.mean(~found.lost)),
    }


def loses_the_turn(figures: Figures) -> bool:
    """Say whether the turn was lost, as where a mug hides its handle."""
    return figures["turned"] > 45.0


@scene("plain objects that sway", {"off": "mm", "turned": "deg"}, {"followed": "%"}, loses_the_turn)
def plain_sway(seed: int, _folder: Path) -> Figures:
    return off_figures(followed("plain", KNOWN, seed))

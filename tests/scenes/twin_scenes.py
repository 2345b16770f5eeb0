"""Draws an object beside which the same one stands at rest, and judges how it is tracked."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scenes_trust import known_body, true_poses
from tracks_through import tracks_through
from trust_scenes import PLAIN, PRINTED, SMALL, Course, mesh_of, sway, write_made
from trust_verdicts import Verdicts, verdicts

from servoid.capture import open_capture
from servoid.pose import Pose
from servoid.sim.world.events.motions import compose, row_of
from servoid.sim.world.objects import make_object
from servoid.sim.world.scene.visuals import Visual
from servoid.track import Request, Subject, TrackResult
from servoid_experiments.tracking.scene import SetUp

TWIN = "twin"  # what carries it: it rests
BESIDE_M = 0.17  # from object to twin in the first image, to the right
_FROM, _STEP_MM = 20, 25.0  # the image in which an object is taken away, and how fast


def away(index: int) -> float:
    """Return how far to the right an object is that is taken away for good, in mm: out of sight."""
    return -_STEP_MM * min(max(index - _FROM, 0), 30)


def away_and_back(index: int) -> float:
    """Return the same of an object that is brought back."""
    return -_STEP_MM * float(np.clip(min(index - _FROM, 60 - index), 0, 14))


TWIN_COURSES = {
    "hidden": Course(PRINTED, 60, 3.0, hidden=1.0),
    "hidden while it sways": Course(PRINTED, 60, 3.0, hidden=1.0, turned_deg=sway),
    "away": Course(PRINTED, 60, 3.0, aside_mm=away),
    "away and back": Course(PRINTED, 80, 3.0, aside_mm=away_and_back),
    "plain and hidden": Course(PLAIN, 60, 3.0, hidden=1.0),
    "plain and away": Course(PLAIN, 60, 3.0, aside_mm=away),
}
RETURNING = ("hidden", "away and back")


class _Twins(SetUp):
    """A scene with a second object; what hides one hides the first one."""

    def __init__(self, of: SetUp, both: tuple[Visual, ...]) -> None:
        super().__init__(of.scene, both)
        self._alone, self.world_from_objects = of._alone, of.world_from_objects


def with_twin(course: Course, seed: int, size_px: tuple[int, int] = SMALL) -> SetUp:
    """Return what a seed shows, and to the right of it the same object as in its first image."""
    of = course.set_up(seed, size_px)
    right = BESIDE_M * of.eyes[0].matrix()[:3, 0]
    place = row_of(Pose.exp([*right, 0.0, 0.0, 0.0]) @ of.world_from_objects[0])
    own = make_object(course.object_of(seed))
    twin = tuple(_carried(one, place) for one in own)
    return _Twins(of, (*own, *twin))


def _carried(one: Visual, place: np.ndarray) -> Visual:
    own = np.array([one.carrier_from_visual])
    return replace(one, carrier=TWIN, carrier_from_visual=compose(place[None], own)[0])


@cache
def tracked_beside_twin(
    folder: Path, name: str, seed: int, *, known: bool = False
) -> tuple[TrackResult, Verdicts]:
    """Draw a course with a twin into a folder, and track its object; return the track, judged."""
    course = TWIN_COURSES[name]
    indices = range(course.images)
    mesh = mesh_of(course.object_of(seed))
    write_made(folder / name / str(seed), with_twin(course, seed), mesh, indices)
    truth = true_poses(folder / name / str(seed))
    subject = Subject()
    if known:
        body = known_body(course.object_of(seed))
        start = truth[0] @ body.world_from_object
        subject = Subject(body=body, start=start, known_shape=True)
    result = tracks_through(open_capture(folder / name / str(seed)), [subject], Request(seed=seed))[
        0
    ]
    return result, verdicts(result.tracked, truth, course.vertices(seed))

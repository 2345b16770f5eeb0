"""Measure from how far away the tracker finds an object again.

Each recording is tracked once with a many-view body. Then the object is searched in single
observations drawn at random, from poses that are wrong by an angle about a random axis and a
distance in a random direction, and finally without a nearby pose. The tracker's knowledge of the
object's appearance before the search is what it learned in the whole recording, or in the preceding
observation. In the last row it has only the mask of the first left image, with some seeds, as when
the command starts with a body and no pose. `Found` is a pose within 5 degrees and 10 mm of the
tracked one; `wrong but trusted` is any other that is reported as tracking. Times are CPU times.
Missing recordings are skipped.
"""

import time
from dataclasses import dataclass

import numpy as np

from sequences import STEREO, Recording, Table, recordings
from servoid._native import Estimate, Tracker
from servoid.camera import Camera
from servoid.pose import Pose
from servoid.shape import Body
from servoid.source import Instant
from servoid.track import Subject, cameras_of

STARTS = ((20.0, 20.0, 60), (45.0, 60.0, 60), (None, None, 40))
ALL_IMAGES, ONE_IMAGE = "the recording", "one image"
MASK_SEEDS = range(5)
FOUND_DEG, FOUND_MM = 5.0, 10.0


@dataclass(frozen=True)
class Search:
    """The result of one search."""

    is_found: bool
    is_trusted: bool
    milliseconds: float


class Known:
    """An object that was tracked through a recording."""

    def __init__(self, recording: Recording) -> None:
        self.cameras, self.body = cameras_of(recording.capture), recording.many_view_body
        self.instants = list(recording.instants())
        start = recording.world_from_mesh(0) @ self.body.world_from_object
        self.tracker, estimate = begun(self.cameras, self.body, self.instants[0], start)
        self.poses, self.trusted = [estimate.world_from_object], [0]
        for index, one in enumerate(self.instants[1:], 1):
            estimate = self.tracker.step(one.time_s, one.world_from_camera, one.images)
            self.poses.append(estimate.world_from_object)
            if estimate.status == "tracking":
                self.trusted.append(index)

    def search(self, index: int, near: Pose | None, knows: str) -> Search:
        """Search the object in an observation after the first."""
        tracker = self.tracker
        if knows == ONE_IMAGE:
            earlier, pose = self.instants[index - 1], self.poses[index - 1]
            tracker, _ = begun(self.cameras, self.body, earlier, pose)
        return seek(tracker, self.instants[index], near, self.poses[index])


def begun(
    cameras: tuple[Camera, ...], body: Body, instant: Instant, pose: Pose
) -> tuple[Tracker, Estimate]:
    """Start a tracker at a known pose."""
    tracker = Tracker(cameras, body)
    return tracker, tracker.start(instant.time_s, instant.world_from_camera, instant.images, pose)


def seek(tracker: Tracker, instant: Instant, near: Pose | None, true: Pose) -> Search:
    """Search an object near a pose or globally, and compare with its true pose."""
    begun = time.process_time()
    seen = (instant.time_s, instant.world_from_camera, instant.images)
    estimate = tracker.find(*seen, near=near)
    return judged(estimate, true, time.process_time() - begun)


def judged(estimate: Estimate, true: Pose, seconds: float) -> Search:
    """Compare an estimate with the object's true pose."""
    twist = (true.inverse() @ estimate.world_from_object).log()
    away = np.array(estimate.world_from_object.translation) - np.array(true.translation)
    found = np.degrees(np.linalg.norm(twist[3:])) < FOUND_DEG
    found = bool(found and 1000.0 * np.linalg.norm(away) < FOUND_MM)
    return Search(found, estimate.status == "tracking", 1000.0 * seconds)


def disturbed(pose: Pose, angle_deg: float, way_mm: float, rng: np.random.Generator) -> Pose:
    """Return a pose with an error of an angle and a distance."""
    axis, way = rng.normal(size=(2, 3))
    turn = np.radians(angle_deg) * axis / np.linalg.norm(axis)
    place = np.array(pose.translation) + 1e-3 * way_mm * way / np.linalg.norm(way)
    turned = pose @ Pose.exp([0.0, 0.0, 0.0, *turn])
    return Pose.from_parts(place.tolist(), list(turned.quaternion))


def measure(recording: Recording, table: Table) -> None:
    """Print one row per kind of start."""
    known, rng = Known(recording), np.random.default_rng(1)
    for knows in (ALL_IMAGES, ONE_IMAGE):
        for angle_deg, way_mm, count in STARTS:
            searches = []
            for index in rng.choice(known.trusted[1:], count):
                near = None
                if angle_deg is not None and way_mm is not None:
                    near = disturbed(known.poses[index], angle_deg, way_mm, rng)
                searches.append(known.search(int(index), near, knows))
            name = "no pose" if angle_deg is None else f"{angle_deg:.0f} deg + {way_mm:.0f} mm"
            report(table, (recording.name, knows, name), searches)
    searches = []
    for seed in MASK_SEEDS:
        since = time.process_time()
        result = recording.track(Subject(body=known.body), seed=seed, observations=slice(0, 1))
        searches.append(judged(result.estimates[0], known.poses[0], time.process_time() - since))
    report(table, (recording.name, "one mask", "no pose"), searches)


def report(table: Table, what: tuple[str, str, str], searches: list[Search]) -> None:
    """Print the results of searches."""
    times = [one.milliseconds for one in searches]
    table.row(
        *(*what, len(searches)),
        100.0 * sum(one.is_found for one in searches) / len(searches),
        sum(one.is_trusted and not one.is_found for one in searches),
        *(float(np.median(times)), float(np.percentile(times, 95)), max(times)),
    )


def main() -> None:
    """Print one table."""
    table = Table(
        *(
            "sequence    ",
            "knows         ",
            "start wrong by ",
            "starts",
            "found %",
            "wrong but trusted",
        ),
        *("ms median", "p95    ", "most   "),
    )
    for recording in recordings(STEREO):
        measure(recording, table)


if __name__ == "__main__":
    main()

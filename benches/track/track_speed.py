"""Time the tracker on one thread: five ellipsoids, a stereo pair of 640x480, images in memory.

After each step, in the same run, OpenCV's pyramidal Lucas-Kanade tracks 200 points in both images
on one thread, from grey images to grey images, as a reference for the machine's speed. A recording
is tracked several times, with the same work each time. `quiet` is the minimum CPU time of each
image over these passes, all threads together, so that other programs matter less; the ratio is that
of quiet medians. A fixed body has five ellipsoids; an evolving one is changed by the tracker's
worker. The last but one column is the mean CPU time per pair, including the worker's.

`--long` then tracks 10,000 images, back and forth, and reports the growth of resident memory.
Missing recordings are skipped.
"""

import argparse
import itertools
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from sequences import STEREO, Recording, Table, recordings, shares
from servoid import model
from servoid._native import Tracker
from servoid.model import fit_capture
from servoid.shape import Body
from servoid.source import Instant
from servoid.track import Request, cameras_of

sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "fixtures"))

from resident_memory import resident_mb

ELLIPSOIDS, POINTS, PASSES = 5, 200, 4
LONG_IMAGES, LONG_ROWS = 10_000, (1_000, 2_000, 5_000, 10_000)

Answer = TypeVar("Answer")


class Times:
    """Times, in milliseconds, of calls that are repeated several times."""

    def __init__(self) -> None:
        self._wall: list[float] = []
        self._processor: list[list[float]] = []

    def begin_pass(self) -> None:
        """Start repeating the same calls."""
        self._processor.append([])

    def call(self, work: Callable[..., Answer], *given: Any) -> Answer:
        """Call, and record the wall time and the CPU time of all threads."""
        begun, busy = time.perf_counter(), time.process_time()
        answer = work(*given)
        self._processor[-1].append(1000.0 * (time.process_time() - busy))
        self._wall.append(1000.0 * (time.perf_counter() - begun))
        return answer

    def percentile(self, percent: float) -> float:
        """Return a percentile of the wall times."""
        return float(np.percentile(self._wall, percent))

    def quiet(self, percent: float) -> float:
        """Return a percentile of the calls' minimum CPU times."""
        return float(np.percentile(np.min(self._processor, axis=0), percent))


class Points:
    """Tracks corners from image to image, as a reference."""

    def __init__(self, instant: Instant) -> None:
        self._grey = greys(instant)
        self._corners = [cv2.goodFeaturesToTrack(one, POINTS, 0.001, 5) for one in self._grey]

    def step(self, grey: list[NDArray[np.uint8]]) -> None:
        """Track the corners of the first image from the previous images to these."""
        for last, now, corners in zip(self._grey, grey, self._corners, strict=True):
            cv2.calcOpticalFlowPyrLK(last, now, corners, np.empty_like(corners))
        self._grey = grey


def greys(instant: Instant) -> list[NDArray[np.uint8]]:
    """Return the grey images of an observation."""
    images = [image for image in instant.images if image is not None]
    return [
        np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8) if image.ndim == 3 else image
        for image in images
    ]


def first_body(recording: Recording) -> Body:
    """Model five ellipsoids from the first pair."""
    request = model.Request(max_ellipsoids=ELLIPSOIDS, delta=0.0)
    return fit_capture(recording.capture, request, observations=slice(0, 1)).body


def started(recording: Recording, body: Body, first: Instant) -> Tracker:
    """Start a tracker in the first observation."""
    tracker = Tracker(cameras_of(recording.capture), body)
    tracker.start(first.time_s, first.world_from_camera, first.images, body.world_from_object)
    return tracker


def measure(recording: Recording, table: Table) -> None:
    """Print two rows: steps with a fixed body, and with one that evolves in parallel."""
    body, instants = first_body(recording), list(recording.instants())
    for evolves in (False, True):
        steps, yardstick = Times(), Times()
        busy_s, size = 0.0, 0
        stages: dict[str, float] = {}
        for _ in range(PASSES):
            for times in (steps, yardstick):
                times.begin_pass()
            tracker, points = started(recording, body, instants[0]), Points(instants[0])
            begun = time.process_time()
            for count, one in enumerate(instants[1:], 1):
                seen = (one.time_s, one.world_from_camera, one.images)
                for stage, spent in steps.call(tracker.step, *seen).seconds.items():
                    stages[stage] = stages.get(stage, 0.0) + spent
                if evolves and count % Request.evolve_every == 0:
                    tracker.begin_evolving()
            busy_s, size = busy_s + time.process_time() - begun, len(tracker.body)
            for one in instants[1:]:
                yardstick.call(points.step, greys(one))
        table.row(
            *(recording.name, "evolves" if evolves else "stays", size),
            *(steps.percentile(50), steps.percentile(99)),
            *(steps.quiet(50), steps.quiet(99), yardstick.quiet(50)),
            *(steps.quiet(50) / yardstick.quiet(50), 1000.0 * busy_s / PASSES / len(instants[1:])),
            shares(stages),
        )


def to_and_fro(instants: list[Instant]) -> Iterator[Instant]:
    """Yield observations to the end, back, and so on, without end."""
    return itertools.cycle([*instants[1:], *instants[-2::-1]])


def measure_memory(recording: Recording, table: Table) -> None:
    """Print what the process keeps in memory after a number of images, including evolution."""
    instants = list(recording.instants())
    tracker = started(recording, first_body(recording), instants[0])
    period_s, lost, first_mb = instants[1].time_s - instants[0].time_s, 0, 0.0
    for count, one in enumerate(itertools.islice(to_and_fro(instants), LONG_IMAGES), 1):
        time_s = instants[0].time_s + count * period_s
        estimate = tracker.step(time_s, one.world_from_camera, one.images)
        lost += estimate.status != "tracking"
        if count % Request.evolve_every == 0 and estimate.status == "tracking":
            tracker.begin_evolving()
        if count in LONG_ROWS:
            now_mb = resident_mb()
            first_mb = first_mb or now_mb
            table.row(
                *(recording.name, count, lost, len(tracker.body), len(tracker.surface[0])),
                *(now_mb, now_mb - first_mb),
            )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--long", action="store_true", help="track 10,000 images too")
    is_long = parser.parse_args().long
    cv2.setNumThreads(1)
    table = Table(
        *("sequence    ", "body   ", "ellipsoids", "ms median", "p99  "),
        *("quiet median", "p99  ", "200 points", "ratio", "CPU ms", "% of a step"),
    )
    for recording in recordings(STEREO):
        measure(recording, table)
    if not is_long:
        return
    print()
    titles = ("sequence    ", "images", "lost", "ellipsoids", "points", "resident MB", "growth MB")
    table = Table(*titles)
    for recording in recordings(STEREO[:1]):
        measure_memory(recording, table)


if __name__ == "__main__":
    main()

"""Time the tracker on one thread: five ellipsoids, a stereo pair of 640x480, images in memory.

Beside each step, in the same run, OpenCV's pyramidal Lucas-Kanade follows 200 points in both
images on one thread, from grey images to grey images, as a yardstick for the machine: the ratio is
of medians. Processor time tells what the wall clock says when nothing else runs. `--long` then
tracks 10,000 images, to and fro, and says how the resident memory grows. Skips what is not there.
"""

import argparse
import itertools
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from sequences import STEREO, Recording, Table, recordings
from servoid import model
from servoid._native import Estimate, Tracker
from servoid.model import fit_capture
from servoid.track import Instant, Request, cameras_of

ELLIPSOIDS, POINTS = 5, 200
LONG_IMAGES, LONG_ROWS = 10_000, (1_000, 2_000, 5_000, 10_000)


@dataclass
class Times:
    """Times of calls, in milliseconds."""

    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def call(self, work: Callable[[], Estimate | None]) -> Estimate | None:
        """Call, and keep the time; processor time is that of all threads."""
        begun, busy = time.perf_counter(), time.process_time()
        answer = work()
        self.processor.append(1000.0 * (time.process_time() - busy))
        self.wall.append(1000.0 * (time.perf_counter() - begun))
        return answer


class Points:
    """Follows corners from image to image, as a yardstick."""

    def __init__(self, instant: Instant) -> None:
        self._grey = greys(instant)
        self._corners = [cv2.goodFeaturesToTrack(one, POINTS, 0.001, 5) for one in self._grey]

    def step(self, grey: list[NDArray[np.uint8]]) -> None:
        """Follow the corners of the first image from the last images to these."""
        for last, now, corners in zip(self._grey, grey, self._corners, strict=True):
            cv2.calcOpticalFlowPyrLK(last, now, corners, None)
        self._grey = grey


def greys(instant: Instant) -> list[NDArray[np.uint8]]:
    """Return the grey images of an observation."""
    images = [image for image in instant.images if image is not None]
    return [
        np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)) if image.ndim == 3 else image
        for image in images
    ]


def started(recording: Recording) -> tuple[Tracker, list[Instant]]:
    """Start a tracker with five ellipsoids from the first pair, and read all images."""
    request = model.Request(max_ellipsoids=ELLIPSOIDS, delta=0.0)
    body = fit_capture(recording.capture, request, observations=slice(0, 1)).body
    tracker, instants = Tracker(cameras_of(recording.capture), body), list(recording.instants())
    first = instants[0]
    tracker.start(first.time_s, first.world_from_camera, first.images, body.world_from_object)
    return tracker, instants


def measure(recording: Recording, table: Table) -> None:
    """Print one row: steps, evolutions between them, and the yardstick."""
    tracker, instants = started(recording)
    points = Points(instants[0])
    steps, evolutions, yardstick, stages = Times(), Times(), Times(), dict[str, float]()
    for count, one in enumerate(instants[1:], 1):
        estimate = steps.call(
            lambda one=one: tracker.step(one.time_s, one.world_from_camera, one.images)
        )
        for stage, spent in (estimate.seconds if estimate else {}).items():
            stages[stage] = stages.get(stage, 0.0) + 1000.0 * spent
        grey = greys(one)
        yardstick.call(lambda grey=grey: points.step(grey))
        if count % Request.evolve_every == 0:
            evolutions.call(lambda: tracker.evolve() and None)
    wall, followed = float(np.median(steps.wall)), float(np.median(yardstick.wall))
    parts = ", ".join(f"{name} {all_ms / len(steps.wall):.2f}" for name, all_ms in stages.items())
    table.row(
        *(recording.name, len(tracker.body), wall, float(np.percentile(steps.wall, 99))),
        *(float(np.median(steps.processor)), float(np.percentile(steps.processor, 99))),
        *(followed, wall / followed, float(np.median(evolutions.wall)), parts),
    )


def to_and_fro(instants: list[Instant]) -> Iterator[Instant]:
    """Go through observations to the end, back, and so on, without end."""
    return itertools.cycle([*instants[1:], *instants[-2::-1]])


def measure_memory(recording: Recording, table: Table) -> None:
    """Print how large the process is after so many images, evolutions included."""
    tracker, instants = started(recording)
    period_s, lost, first_mb = instants[1].time_s - instants[0].time_s, 0, 0.0
    for count, one in enumerate(itertools.islice(to_and_fro(instants), LONG_IMAGES), 1):
        time_s = instants[0].time_s + count * period_s
        estimate = tracker.step(time_s, one.world_from_camera, one.images)
        lost += estimate.status != "tracking"
        if count % Request.evolve_every == 0 and estimate.status == "tracking":
            tracker.evolve()
        if count in LONG_ROWS:
            now_mb = resident_mb()
            first_mb = first_mb or now_mb
            table.row(
                *(recording.name, count, lost, len(tracker.body), len(tracker.surface[0])),
                *(now_mb, now_mb - first_mb),
            )


def resident_mb() -> float:
    """Return the resident size of this process, in megabytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--long", action="store_true", help="track 10,000 images too")
    is_long = parser.parse_args().long
    cv2.setNumThreads(1)
    table = Table(
        *("sequence    ", "ellipsoids", "ms median", "p99  ", "processor ms", "p99  "),
        *("200 points ms", "ratio", "evolving ms", "ms of each stage"),
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

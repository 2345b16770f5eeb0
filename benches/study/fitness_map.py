"""Time the map of Fig. 8: 68,921 positions with the paper's points and with servoid's terms.

A stereo pair of 640x480 of the paper's ellipsoid in the simulated world; all threads. Each line is
the minimum of three runs, with the ratio to the points in the same run.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from servoid._native import Body, PaperSettings, Pose, Tracker, TrackSettings, View, paper_scores
from servoid.segment.hue import hue_window, match_image
from servoid_experiments.paper.eye_pair import (
    EyePair,
    Moment,
    PairSettings,
    paper_hand,
    see,
    true_body,
)
from servoid_experiments.paper.maps.case import MapTrial
from servoid_experiments.paper.maps.places import Places
from servoid_experiments.stage import EyeMode

RUNS = 3


def tracker_of(pair: EyePair, body: Body, *, surface: bool) -> Tracker:
    """Return a tracker that has learned the object's appearance."""
    settings = TrackSettings(surface=surface, local_colors=False)
    tracker = Tracker(pair.cameras, body, settings)
    tracker.start(0.0, pair.world_from_cameras, pair.images, pair.world_from_object, pair.masks)
    return tracker


def least_seconds(work: Callable[[], object]) -> float:
    """Return the minimum time of the work."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Print the table."""
    trial, hand = MapTrial(), paper_hand()
    places = Places(trial).box()
    turns = np.tile(hand.quaternion, (len(places), 1))
    poses = np.hstack([turns, hand.transform(np.ascontiguousarray(places))])
    for name in ("ellipsoid", "painted_ellipsoid"):
        there = Pose.from_parts(trial.place, [1.0, 0.0, 0.0, 0.0])
        pair = see(PairSettings(), Moment(name, there, hand, EyeMode.VERGED, 0))
        body = true_body(name, pair.world_from_object)
        masks = pair.masks
        if name == "ellipsoid":
            window = hue_window(pair.images[0], pair.masks[0])
            masks = tuple(match_image(image, *window) for image in pair.images)
        eyes = zip(pair.cameras, pair.world_from_cameras, masks, strict=True)
        views = [View(camera=c, world_from_camera=p, mask=m) for c, p, m in eyes]
        points = least_seconds(partial(paper_scores, views, body, poses, PaperSettings()))
        print(f"{name}, {len(poses):,} poses\n  points              {points:7.3f} s")
        for title, surface in (("region", False), ("region and surface", True)):
            tracker = tracker_of(pair, body, surface=surface)
            eyes, images = pair.world_from_cameras, pair.images
            seconds = least_seconds(partial(tracker.score_terms, 1.0, eyes, images, poses))
            print(f"  {title:18}  {seconds:7.3f} s, {points / seconds:5.1f} times as fast")


if __name__ == "__main__":
    main()

"""The moving toy, followed in many courses of it, and how far off its track is."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from recordings import SCENARIOS, Alone, Recording, pose_text, run_servoid, track_alone
from scene_table import Figures, scene
from tracking_errors import TrackingErrors

from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory
from servoid.shape import load_body
from servoid.sim import MovingScene, write_moving_sample

EVOLVED = (10, 20, 30)
Track = tuple[list[Waypoint], TrackingErrors]


@cache
def _shelf() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory()


@cache
def recording_of(name: str, seed: int) -> Recording:
    """Make a recording of `SCENARIOS` with another seed; it stays while the process runs."""
    scenario = replace(SCENARIOS[name], seed=seed)
    path = Path(_shelf().name) / f"{name} {seed}"
    return Recording(write_moving_sample(path, scenario), MovingScene(scenario))


@cache
def alone_of(seed: int, *options: object) -> Alone:
    """Track the toy with no body, as the fixture `alone` does."""
    folder = Path(tempfile.mkdtemp(dir=_shelf().name))
    return track_alone(recording_of("colour", seed), folder, "--seed", seed, *options)


def tracked(recording: Recording, folder: Path, *options: object) -> Track:
    run_servoid(folder, "track", recording.folder, *options)
    points = read_trajectory(folder / "poses.csv")
    return points, recording.errors(points)


def known(alone: Alone, recording: Recording) -> tuple[object, ...]:
    """Return the options that say which body it is and where it is at first."""
    start = pose_text(alone.start_in(recording))
    return ("--body", alone.folder / "body.json", "--start", start)


UNITS = {"not tracking": "images", "add median": "mm", "add worst": "mm", "turn worst": "deg"}


def not_tracking(points: Sequence[Waypoint]) -> int:
    return sum(point.status != "tracking" for point in points)


def track_figures(points: Sequence[Waypoint], errors: TrackingErrors) -> Figures:
    """Say how far a track is off."""
    return {
        "not tracking": not_tracking(points),
        "add median": 1e3 * float(np.median(errors.add)),
        "add worst": 1e3 * float(errors.add.max()),
        "turn worst": float(np.degrees(errors.rotation.max())),
    }


def off_figures(away: Sequence[Pose], name: str) -> Figures:
    """Say how far poses are from where they should be, at worst."""
    changes = np.array([one.log() for one in away])
    return {
        f"{name} off": 1e3 * float(np.linalg.norm(changes[:, :3], axis=1).max()),
        f"{name} turned": float(np.degrees(np.linalg.norm(changes[:, 3:], axis=1).max())),
    }


def off_units(name: str) -> dict[str, str]:
    return {f"{name} off": "mm", f"{name} turned": "deg"}


def std_figures(alone: Alone) -> Figures:
    """Compare the standard deviations that are told with the errors."""
    errors = alone.recording.errors(alone.points)
    reported = np.array([point.std_m for point in alone.points[1:]], dtype=float)
    middle = float(np.median(reported))
    return {
        "error by std": float(np.median(errors.translation)) / middle,
        "std by error": middle / float(np.median(errors.add)),
    }


def evolved_figures(alone: Alone) -> Figures:
    """Say how far the pose jumps where the body evolves."""
    jumps = []
    for at in EVOLVED:
        before, after = (
            Pose(alone.recording.truth(index)).inverse() @ alone.points[index].world_from_object
            for index in (at, at + 1)
        )
        jumps.append(before.inverse() @ after)
    return off_figures(jumps, "jump")


@scene("track alone", {**UNITS, **off_units("jump"), "error by std": "1", "std by error": "1"})
def track_toy(seed: int, _folder: Path) -> Figures:
    alone = alone_of(seed)
    figures = track_figures(alone.points, alone.recording.errors(alone.points))
    return {**figures, **std_figures(alone), **evolved_figures(alone)}


def outline_figures(alone: Alone, as_it_was: Alone) -> Figures:
    """Compare the outlines of a body that evolved and of one that did not with true masks."""
    at = (0, 13, 26, 39)
    evolved, still = (
        alone.recording.overlaps(one.body, [one.points[index] for index in at])
        for one in (alone, as_it_was)
    )
    return {
        "missed": 1.0 - float(evolved.min()),
        "missed more": max(0.0, float(still.mean() - evolved.mean())),
    }


@scene("track evolving outline", {"missed": "1", "missed more": "1"})
def evolving_outline(seed: int, _folder: Path) -> Figures:
    return outline_figures(alone_of(seed), alone_of(seed, "--no-evolve"))


def on_again(alone: Alone, folder: Path, *more: object) -> Track:
    """Track on with a saved body, from the pose that it had in the middle."""
    start = pose_text(alone.points[20].world_from_object)
    body = ("--body", alone.folder / "body.json", "--start", start)
    return tracked(alone.recording, folder, *body, "--observations", "20:", *more)


@scene("track on again", UNITS)
def track_on_again(seed: int, folder: Path) -> Figures:
    return track_figures(*on_again(alone_of(seed), folder, "--seed", seed))


def in_the_mask(alone: Alone, folder: Path, *more: object) -> Track:
    """Place a saved body in the first mask, and follow it."""
    body = ("--body", alone.folder / "body.json", "--observations", ":25")
    return tracked(alone.recording, folder, *body, *more)


def in_the_mask_figures(alone: Alone, track: Track) -> Figures:
    away = alone.start_in(alone.recording).inverse() @ track[0][0].world_from_object
    return {**track_figures(*track), **off_figures([away], "start")}


@scene("track placed in mask", {**UNITS, **off_units("start")})
def placed_in_mask(seed: int, folder: Path) -> Figures:
    alone = alone_of(seed)
    return in_the_mask_figures(alone, in_the_mask(alone, folder, "--seed", seed))


def by_its_looks(recording: Recording, folder: Path, *more: object) -> list[Waypoint]:
    """Model the toy, and follow it from where no mask says where it is."""
    options = ("--max-ellipsoids", 4, "--out", "body.json", *more)
    run_servoid(folder, "model", recording.folder, *options)
    body = ("--body", "body.json", "--observations", "8:14", *more)
    return tracked(recording, folder, *body)[0]


def by_its_looks_figures(recording: Recording, folder: Path, points: list[Waypoint]) -> Figures:
    body = load_body(folder / "body.json").body()
    toy_from_body = Pose(recording.truth(0)).inverse() @ body.world_from_object
    away = [
        (Pose(recording.truth(one.observation or 0)) @ toy_from_body).inverse()
        @ one.world_from_object
        for one in points
    ]
    return {"not tracking": not_tracking(points), **off_figures(away, "pose")}


@scene("track found by looks", {"not tracking": "images", **off_units("pose")})
def found_by_looks(seed: int, folder: Path) -> Figures:
    seen = recording_of("colour", seed)
    return by_its_looks_figures(seen, folder, by_its_looks(seen, folder, "--seed", seed))

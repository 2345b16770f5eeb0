"""The toy is followed in other circumstances, with the body that a first track made."""

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from faults import Moments
from recordings import SNAIL, WRONG_M, WRONG_RAD, Alone, Recording, pose_text, run_servoid, wrong
from scene_table import Figures, scene
from scenes_tracking import (
    UNITS,
    Track,
    alone_of,
    known,
    not_tracking,
    recording_of,
    track_figures,
    tracked,
)
from tracking_errors import tracking_errors

from servoid._native import Estimate
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.record import Waypoint, read_trajectory
from servoid.sim import MovingScene, Scenario

BAR_PX, BAR_STEP_PX, BAR_DISPARITY_PX = 16, 6, 69
BESIDE_PX = 20.0  # about a third of the toy


@scene("track evolving", UNITS)
def evolving(seed: int, folder: Path) -> Figures:
    alone = alone_of(seed)
    options = (*known(alone, alone.recording), "--evolve", "--seed", seed)
    return track_figures(*tracked(alone.recording, folder, *options))


@scene("track grey", UNITS)
def grey(seed: int, folder: Path) -> Figures:
    return track_figures(*tracked(recording_of("grey", seed), folder, "--seed", seed))


def _known_in(name: str, seed: int, folder: Path, *options: object) -> Track:
    seen = recording_of(name, seed)
    return tracked(seen, folder, *known(alone_of(seed), seen), *options, "--seed", seed)


def is_wrong(figures: Figures) -> bool:
    """Say whether a pose that is told is no pose of the toy."""
    return figures["add worst"] > 1e3 * WRONG_M or figures["turn worst"] > np.degrees(WRONG_RAD)


@scene("track one camera", UNITS, fails=is_wrong)
def one_camera(seed: int, folder: Path) -> Figures:
    return track_figures(*_known_in("one camera", seed, folder))


@scene("track every second", UNITS, fails=is_wrong)
def every_second(seed: int, folder: Path) -> Figures:
    return track_figures(*_known_in("colour", seed, folder, "--every", 2))


def at_rest_figures(track: Track) -> Figures:
    places = np.array([point.world_from_object.translation for point in track[0]])
    return {**track_figures(*track), "drift": 1e3 * float(np.ptp(places, axis=0).max())}


@scene("track at rest", {**UNITS, "drift": "mm"})
def at_rest(seed: int, folder: Path) -> Figures:
    return at_rest_figures(_known_in("hand", seed, folder))


@scene("track by the paper", {"translation worst": "mm"})
def by_the_paper(seed: int, folder: Path) -> Figures:
    options = ("--method", "paper", "--observations", ":12")
    return paper_figures(_known_in("colour", seed, folder, *options))


def paper_figures(track: Track) -> Figures:
    return {"translation worst": 1e3 * float(track[1].translation.max())}


def at_a_distance(recording: Recording, folder: Path, *more: object) -> list[Waypoint]:
    """Follow what one camera sees with no body, but with the distance that it has at first."""
    distance = float(np.linalg.norm(recording.truth(0)[:3, 3]))
    return tracked(recording, folder, "--distance", round(distance, 2), *more)[0]


def at_a_distance_figures(recording: Recording, points: Sequence[Waypoint]) -> Figures:
    toy_from_body = np.linalg.inv(recording.truth(0)) @ points[0].world_from_object.matrix()
    apart = []
    for point in points:
        true = recording.truth(point.observation or 0) @ toy_from_body
        found = np.array(point.world_from_object.translation)
        focal_px = recording.scene.camera.focal_px[0]
        away = focal_px * (found / found[2] - true[:3, 3] / true[2, 3])
        apart.append(float(np.linalg.norm(away)))
    return {
        "lost": sum(point.status == "lost" for point in points),
        "not tracking at first": not_tracking(points[:5]),
        "apart": max(apart),
    }


@scene(
    "track at a distance",
    {"lost": "images", "not tracking at first": "images", "apart": "px"},
    fails=lambda figures: figures["apart"] > BESIDE_PX,
)
def distant(seed: int, folder: Path) -> Figures:
    seen = recording_of("one camera", seed)
    return at_a_distance_figures(seen, at_a_distance(seen, folder, "--seed", seed))


def veiled(moments: Moments) -> tuple[Moments, list[int]]:
    """Let a striped bar pass before the cameras; return where its left edge is in the left one."""
    random = np.random.default_rng(5)
    stripes = random.integers(60, 190, (1, BAR_PX, 3)).astype(np.uint8)
    found, edges = [], []
    for index, moment in enumerate(moments):
        edges.append(60 + BAR_STEP_PX * index)
        images = [image.copy() for image in moment.images if image is not None]
        for image, edge in zip(images, (edges[-1], edges[-1] - BAR_DISPARITY_PX), strict=True):
            low, high = np.clip((edge, edge + BAR_PX), 0, image.shape[1])
            image[:, low:high] = stripes[:, low - edge : high - edge]
        found.append(replace(moment, images=tuple(images)))
    return found, edges


def veiled_figures(alone: Alone, seen: Recording) -> Figures:
    """Track the toy while a bar passes before it."""
    moments, edges = veiled(seen.moments())
    tracker = alone.tracker_in(seen, moments[0])
    estimates = [tracker.step(one.time_s, one.world_from_camera, one.images) for one in moments[1:]]
    truth = [seen.truth(index) for index in range(len(moments))]
    poses = [one.world_from_object.matrix() for one in estimates]
    errors = tracking_errors([alone.start_in(seen).matrix(), *poses], truth, SNAIL)
    seen_well = np.array([one.status == "tracking" for one in estimates])
    return {
        "lost": sum(one.status == "lost" for one in estimates),
        "not tracking": 1.0 - float(seen_well.mean()),
        "not tracking at last": 5 - int(seen_well[-5:].sum()),
        "wrong and tracking": int((wrong(errors) & seen_well).sum()),
        "add median": 1e3 * float(np.median(errors.add)),
        "share drop": share_drop(seen, truth, edges, estimates),
    }


def share_drop(
    seen: Recording,
    truth: Sequence[Floats],
    edges: Sequence[int],
    estimates: Sequence[Estimate],
) -> float:
    """Return how much less is seen of the toy while the bar is before it."""
    share = np.array([(one.evidence or {"share": 0.0})["share"] for one in estimates])
    camera = seen.scene.camera
    middle = np.array(
        [camera.focal_px[0] * pose[0, 3] / pose[2, 3] + camera.center_px[0] for pose in truth[1:]]
    )
    before = np.abs(np.array(edges[1:]) + BAR_PX / 2 - middle) < 12.0
    aside = np.array(edges[1:]) < middle - 75.0
    return float(share[aside].mean() - share[before].mean())


VEILED = {
    "lost": "images",
    "not tracking": "1",
    "not tracking at last": "images",
    "wrong and tracking": "images",
    "add median": "mm",
}


def is_left_behind(figures: Figures) -> bool:
    """Say whether the toy is not tracked when the bar has gone, or a wrong pose was believed."""
    return figures["not tracking at last"] > 0 or figures["wrong and tracking"] > 0


@scene("track veiled", VEILED, {"share drop": "1"}, is_left_behind)
def behind_a_bar(seed: int, _folder: Path) -> Figures:
    return veiled_figures(alone_of(seed), recording_of("colour", seed))


class Aside(MovingScene):
    """The scene with its toy moved to the right, in metres, and `ahead` by so many images."""

    def __init__(self, scenario: Scenario, right: float, ahead: int) -> None:
        super().__init__(scenario)
        self.right, self.ahead = right, ahead

    def room_from_object(self, index: int) -> Floats:
        pose = super().room_from_object(index + self.ahead)
        pose[0, 3] += self.right
        return pose


Toys = tuple[Path, tuple[Aside, Aside]]


def write_pair(like: Recording, folder: Path) -> Toys:
    """Write a recording of two toys of which neither hides the other."""
    scenario = Scenario(count=8, size="small", seed=like.scene.scenario.seed)
    for name in ("left", "right", "masks"):
        (folder / name).mkdir(parents=True)
    shutil.copy(like.folder / "capture.toml", folder)
    scenes = (Aside(scenario, -0.14, 0), Aside(scenario, 0.16, 62))
    empty = Aside(scenario, 90.0, 0)
    assert cv2.imwrite(str(folder / "masks" / "000000.png"), scenes[0].look(0).mask)
    for index in range(len(empty)):
        looks = [scene.look(index).images for scene in (*scenes, empty)]
        for name, first, second, room in zip(("left", "right"), *looks, strict=True):
            # All three have the same noise, so that they differ where a toy or its edge is.
            both = np.where((second != room).any(axis=2, keepdims=True), second, first)
            assert cv2.imwrite(str(folder / name / f"{index:06d}.png"), both[..., ::-1])
    toml = (folder / "capture.toml").read_text()
    (folder / "capture.toml").write_text(toml.replace("*.jpg", "*.png"))
    return folder, scenes


def track_pair(alone: Alone, pair: Toys, folder: Path, *more: object) -> str:
    """Track both toys; return what the command says."""
    options = list(more)
    for name, toy in zip("ab", pair[1], strict=True):
        start = Pose(toy.left_from_object(0) @ alone.toy_from_body)
        options += ["--body", f"{name}={alone.folder / 'body.json'}"]
        options += ["--start", f"{name}={pose_text(start)}"]
    return run_servoid(folder, "track", pair[0], *options)


def pair_figures(pair: Toys, folder: Path) -> Figures:
    """Say how far off the track of the worse toy is."""
    both = []
    for name, toy in zip("ab", pair[1], strict=True):
        points = read_trajectory(folder / f"poses_{name}.csv")
        assert len(points) == len(toy)
        both.append(track_figures(points, Recording(pair[0], toy).errors(points)))
    return {name: max(one[name] for one in both) for name in UNITS}


@scene("track two toys", UNITS)
def two_toys(seed: int, folder: Path) -> Figures:
    pair = write_pair(recording_of("colour", seed), folder / "video")
    track_pair(alone_of(seed), pair, folder, "--seed", seed)
    return pair_figures(pair, folder)

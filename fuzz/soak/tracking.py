"""Tracks a toy that moves while its cameras fail at random, and holds it against the truth."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.soak.camera_faults import CameraFaults, Image
from fuzz.soak.health import Health
from servoid.camera import Camera
from servoid.capture import View
from servoid.errors import ServoidError
from servoid.model import fit
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.record import Waypoint, read_trajectory, write_trajectory
from servoid.shape import Body
from servoid.sim import MovingScene, Scenario
from servoid.sim.samples import snail
from servoid.sim.samples.surface import outer_mesh
from servoid.track import Estimate, Tracker, TrackSettings

WRONG_M, WRONG_RAD = 0.02, np.radians(15.0)  # as everywhere: from there on a pose is wrong
SCENES = tuple(
    Scenario(count=90, size="small", seed=seed, grey=grey, hand=hand, one_camera=one)
    for seed, grey, hand, one in (
        (0, False, False, False),
        (1, False, True, False),
        (2, True, False, False),
        (3, False, False, True),
        (4, False, True, True),
    )
)
STATUSES = {"tracking", "searching", "lost"}
POINTS = 300
LOOKS, APART = 12, 14  # images that the toy is modelled of, and from one to the next
RATE_HZ = 30.0
MOST_IN_A_ROW = 1  # images that may be wrong and said to be tracked


@dataclass(frozen=True, eq=False)
class Footage:
    """A scene that is played to and fro: its images, and what is true of each."""

    camera: Camera
    images: tuple[tuple[Image, ...], ...]
    world_from_camera: tuple[tuple[Pose, ...], ...]
    world_from_object: tuple[Pose, ...]

    def __len__(self) -> int:
        return len(self.images)


@cache
def footage(scenario: Scenario) -> Footage:
    """Draw a scene, once."""
    scene = MovingScene(scenario)
    every = range(len(scene))
    return Footage(
        camera=scene.camera,
        images=tuple(scene.look(index).images for index in every),
        world_from_camera=tuple(
            tuple(map(Pose, scene.room_from_cameras(index))) for index in every
        ),
        world_from_object=tuple(Pose(scene.room_from_object(index)) for index in every),
    )


@cache
def toy() -> tuple[Body, Pose, Floats]:
    """Model the toy of all scenes by outlines from around it.

    Return the body, where it lies in the toy's frame, and points (N, 3) of the toy's surface.
    """
    scene = MovingScene(Scenario(count=LOOKS * APART, size="small", hand=True, one_camera=True))
    views = []
    for index in range(0, len(scene), APART):
        world_from_camera = Pose(scene.room_from_cameras(index)[0])
        mask = scene.look(index).mask
        views.append(View(camera=scene.camera, world_from_camera=world_from_camera, mask=mask))
    body = fit(views, max_ellipsoids=5).body
    vertices, _ = outer_mesh(snail.PARTS)
    chosen = np.random.default_rng(0).permutation(len(vertices))[:POINTS]
    toy_from_world = Pose(scene.room_from_object(0)).inverse()
    return body, toy_from_world @ body.world_from_object, vertices[chosen]


def soak_tracking(random: np.random.Generator, images: int, folder: Path, health: Health) -> None:
    """Track one scene for so many images with faults at random; `health` hears what is wrong."""
    shown = footage(SCENES[int(random.integers(len(SCENES)))])
    body, toy_from_body, points = toy()
    course = _Course(random, len(shown))
    tracker = _started(shown, course.index, body, toy_from_body, random)
    faults = CameraFaults(random, len(shown.images[0]))
    judge = _Judge(health, points, toy_from_body)
    way: list[Waypoint] = []
    for count in range(1, images + 1):
        course.go_on(faults.leaps())
        taken = faults.strike(count / RATE_HZ, shown.images[course.index])
        health.images += 1
        estimate = _stepped(tracker, taken, shown.world_from_camera[course.index], health)
        if estimate is None:
            continue
        judge.see(estimate, shown.world_from_object[course.index], faults.kind, taken.is_dark)
        way.append(Waypoint(count / RATE_HZ, estimate.world_from_object))
    judge.end()
    _keep(way, folder / "track.csv", health)


def _stepped(tracker: Any, taken: Any, poses: tuple[Pose, ...], health: Health) -> Estimate | None:
    """Take a step; return None where it was refused, as it must be for what is no image."""
    try:
        return tracker.step(taken.time_s, list(poses), list(taken.images))
    except ServoidError:
        health.counts["steps refused"] += 1
    except Exception as error:  # what is no ServoidError is what is sought
        health.wrong(f"a step raised {type(error).__name__}: {error}")
    return None


def _started(
    shown: Footage, index: int, body: Body, toy_from_body: Pose, random: np.random.Generator
) -> Tracker:
    settings = TrackSettings(seed=int(random.integers(1 << 31)))
    tracker = Tracker([shown.camera] * len(shown.images[0]), body, settings)
    start = shown.world_from_object[index] @ toy_from_body
    tracker.start(0.0, list(shown.world_from_camera[index]), list(shown.images[index]), start)
    return tracker


class _Course:
    """Goes through footage to and fro; now and then it leaps."""

    def __init__(self, random: np.random.Generator, count: int) -> None:
        self._random, self._count, self._way = random, count, 1
        self.index: int = int(random.integers(1, count - 1))

    def go_on(self, leaps: bool) -> None:
        """Go to the next image, or to any."""
        if leaps:
            self.index = int(self._random.integers(1, self._count - 1))
        if not 0 <= self.index + self._way < self._count:
            self._way = -self._way
        self.index += self._way


class _Judge:
    """Holds each estimate against the truth and against what estimates promise."""

    def __init__(self, health: Health, points: Floats, toy_from_body: Pose) -> None:
        self._health, self._points, self._toy_from_body = health, points, toy_from_body
        self._row, self._kind = 0, ""

    def see(self, estimate: Estimate, truth: Pose, kind: str, dark: bool) -> None:
        """Judge one estimate; `kind` is the fault that is on, `dark` that no image arrived."""
        for words in _insane(estimate, dark):
            self._health.wrong(f"{words}, with the fault '{kind}'")
        counts = self._health.counts
        counts[estimate.status] += 1
        trusted = estimate.status == "tracking" and self._is_wrong(estimate, truth)
        if trusted:
            counts[f"wrong and trusted ({kind})"] += 1
            self._row, self._kind = self._row + 1, kind
            return
        self.end()

    def end(self) -> None:
        """Judge the images in a row that were wrong and trusted; a new row may begin."""
        if self._row > MOST_IN_A_ROW:
            self._health.wrong(
                f"{self._row} images in a row were wrong and said to be tracked, with the fault "
                f"'{self._kind}', until image {self._health.images} of all"
            )
        self._row = 0

    def _is_wrong(self, estimate: Estimate, truth: Pose) -> bool:
        found = estimate.world_from_object @ self._toy_from_body.inverse()
        apart = found.transform(self._points) - truth.transform(self._points)
        turn = float(np.linalg.norm((truth.inverse() @ found).log()[3:]))
        return float(np.linalg.norm(apart, axis=1).mean()) > WRONG_M or turn > WRONG_RAD


def _insane(estimate: Estimate, dark: bool) -> list[str]:
    """Say what an estimate must never be."""
    pose, spread = estimate.world_from_object.matrix(), np.array(estimate.covariance)
    checks: dict[str, Callable[[], bool]] = {
        f"the status is {estimate.status!r}": lambda: estimate.status in STATUSES,
        f"the confidence is {estimate.confidence}": lambda: 0.0 <= estimate.confidence <= 1.0,
        "the pose is not finite": lambda: bool(np.isfinite(pose).all()),
        "the covariance has NaN": lambda: not np.isnan(spread).any(),
        "the covariance is negative": lambda: bool((np.diag(spread) >= 0.0).all()),
        "tracking is said of no image": lambda: not (dark and estimate.status == "tracking"),
        "a notice is empty": lambda: all(estimate.notices),
    }
    return [words for words, holds in checks.items() if not holds()]


def _keep(way: list[Waypoint], path: Path, health: Health) -> None:
    """Write the track over the last one, and read it back."""
    write_trajectory(path, way)
    back = read_trajectory(path)
    if len(back) != len(way):
        health.wrong(f"{path.name} holds {len(back)} of {len(way)} poses")
    left = [one.name for one in path.parent.iterdir() if one.name.startswith(".servoid-")]
    if left:
        health.wrong(f"drafts were left behind: {', '.join(left)}")

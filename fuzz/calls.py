"""Calls of the core with numbers that no one should give, drawn by what the bytes say."""

import random
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import (
    Body,
    Camera,
    Lens,
    ModelInput,
    ModelSettings,
    Pose,
    Tracker,
    TrackSettings,
    View,
    fit_body,
    silhouette_ious,
)

_ODD = (0.0, -0.0, 1e-320, 1e-9, 0.5, 1.0, -1.0, 3.0, 1e9, 1e154, 1e308, float("nan"), float("inf"))
SMALL = Camera(size_px=(33, 24), focal_px=(40.0, 40.0), center_px=(16.0, 11.5))
AHEAD = Pose.from_parts((0.0, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0))
_SIDES = (0, 1, 2, 16, 33, 8192, 8193)


def call_the_core(data: bytes, _: Path) -> None:
    """Make a pose, cameras, a body, views and a tracker, and use what can be made.

    Raises:
        ServoidError: one of them cannot be.

    """
    rng = random.Random(data)
    rng.choice((_poses, _lenses, _bodies, _modelling, _tracking))(rng)


def _number(rng: random.Random) -> float:
    return rng.choice(_ODD) if rng.random() < 0.15 else rng.uniform(-1.0, 1.0)


def _numbers(rng: random.Random, count: int) -> list[float]:
    return [_number(rng) for _ in range(count)]


def _pose(rng: random.Random) -> Pose:
    if rng.random() < 0.8:
        return Pose.exp([rng.uniform(-0.3, 0.3) for _ in range(6)])
    return Pose.from_parts(_numbers(rng, 3), _numbers(rng, 4))


def _poses(rng: random.Random) -> None:
    pose = Pose.exp(_numbers(rng, 6)) @ _pose(rng)
    pose.inverse().transform(np.array([_numbers(rng, 3)]))


def _camera(rng: random.Random) -> Camera:
    if rng.random() < 0.8:
        return SMALL
    size = rng.choice(_SIDES), rng.choice(_SIDES)
    (fx, fy, cx, cy) = _numbers(rng, 4)
    return Camera(size_px=size, focal_px=(fx, fy), center_px=(cx, cy))


def _lenses(rng: random.Random) -> None:
    model = rng.choice(("pinhole", "brown_conrady", "kannala_brandt", "fish"))
    (fx, fy, cx, cy) = (40.0 * number for number in _numbers(rng, 4))
    lens = Lens(
        model=model,
        size_px=(33, 24),
        focal_px=(fx, fy),
        center_px=(cx, cy),
        distortion=_numbers(rng, rng.choice((0, 4, 5, 8))),
    )
    lens.rays(lens.project(np.array([_numbers(rng, 3) for _ in range(4)])))
    lens.map_to(_camera(rng), _pose(rng))


def _body(rng: random.Random) -> Body:
    count = rng.choice((1, 2, 3, 64, 65))
    odd = rng.random() < 0.2
    radii = [
        [abs(_number(rng)) if odd else rng.uniform(0.01, 0.1) for _ in range(3)]
        for _ in range(count)
    ]
    return Body(
        world_from_object=_pose(rng),
        centers=np.array([[0.1 * x for x in _numbers(rng, 3)] for _ in range(count)]),
        radii=np.array(radii),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
    )


def _bodies(rng: random.Random) -> None:
    body, camera = _body(rng), _camera(rng)
    body.silhouette(camera, _pose(rng))


def _image(rng: random.Random, camera: Camera, channels: int = 3) -> NDArray[np.uint8]:
    width, height = camera.size_px
    draw = np.random.default_rng(rng.randrange(1 << 32))
    return draw.integers(0, rng.choice((1, 2, 256)), (height, width, channels), np.uint8)


def _modelling(rng: random.Random) -> None:
    views = []
    for _ in range(rng.choice((0, 1, 2, 4))):
        camera = _camera(rng)
        mask = np.where(_image(rng, camera, 1)[..., 0] > 127, 255, 0).astype(np.uint8)
        views.append(View(camera=camera, world_from_camera=_pose(rng), mask=mask))
    settings = ModelSettings(
        max_ellipsoids=rng.choice((0, 1, 2, 65)), delta=abs(_number(rng)), quick=True, threads=1
    )
    steps = fit_body(ModelInput(views=views), settings, lambda *_: None)
    silhouette_ious(steps[-1].body, views)


def learned_looks() -> bytes:
    """Return what a small object looks like, as a tracker has learned it."""
    tracker = small_tracker()
    image = np.random.default_rng(0).integers(0, 256, (24, 33, 3), np.uint8)
    tracker.start(0.0, [Pose.identity()], [image], AHEAD)
    for index in range(1, 6):
        tracker.step(index / 30.0, [Pose.identity()], [image])
    return tracker.appearance()


def small_tracker() -> Tracker:
    """Return a tracker of one ellipsoid in small images, which has not begun."""
    body = Body(
        world_from_object=Pose.identity(),
        centers=np.zeros((1, 3)),
        radii=np.array([[0.06, 0.05, 0.04]]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    return Tracker([SMALL], body, TrackSettings(population=8, adjust=False))


def _tracking(rng: random.Random) -> None:
    camera = SMALL
    settings = TrackSettings(
        population=rng.choice((7, 8, 16)),
        budget_s=rng.choice((None, _number(rng))),
        adjust=False,
    )
    tracker = Tracker([camera], _body(rng), settings)
    ahead = Pose.from_parts((0.0, 0.0, rng.choice((0.5, 1e-9, 1e30))), (1.0, 0.0, 0.0, 0.0))
    time_s = _number(rng)
    tracker.start(time_s, [Pose.identity()], [_image(rng, camera)], ahead)
    for _ in range(3):
        time_s += _number(rng)
        tracker.step(time_s, [_pose(rng)], [rng.choice((None, _image(rng, camera)))])

"""What every source of observations must do; a new one is one more line in `SOURCES`."""

from collections.abc import Callable

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servoid.observe import Instant, Source
from servoid.servo import Arm
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    DropImages,
    FreezeCamera,
    ObjectSettings,
    World,
    WorldSettings,
)

SECONDS = 1.0


def in_a_world(distortion: tuple[float, ...] = (), **changes: object) -> tuple[Arm, Source]:
    cameras = CameraSettings(size_px=(64, 48), samples=1, moments=1, distortion=distortion)
    moving = ObjectSettings(path="sine:0.05@2s")
    settings = {"background": "plain", "cameras": cameras, "object": moving, **changes}
    world = World(WorldSettings(**settings))
    world.start_path()
    return world.arm, world.source


SOURCES: dict[str, Callable[[], tuple[Arm, Source]]] = {
    "a world": in_a_world,
    "a world with fixed eyes": lambda: in_a_world(arm=ArmSettings(turning_eyes=False)),
    "a world with lenses that distort": lambda: in_a_world((-0.2, 0.05, 0.0, 0.0)),
    "a world that loses images": lambda: in_a_world(
        faults=(DropImages(at_s=0.3, seconds=0.2, camera=0), DropImages(at_s=0.6, seconds=0.2))
    ),
    "a world with a camera that hangs": lambda: in_a_world(
        faults=(FreezeCamera(at_s=0.3, seconds=0.3, camera=1),)
    ),
}


@pytest.fixture(scope="module", params=SOURCES.values(), ids=SOURCES.keys())
def pair(request: pytest.FixtureRequest) -> tuple[Arm, Source]:
    return request.param()


@pytest.fixture(scope="module")
def arrived(pair: tuple[Arm, Source]) -> list[tuple[float, Instant]]:
    """Return the observations of a second in which the arm moves, and when they arrived."""
    arm, source = pair
    found = []
    slowly = np.full(len(arm.joints.names), 0.05)
    while arm.state().time_s < SECONDS:
        instant = source.newest()
        if instant is not None:
            found.append((arm.state().time_s, instant))
        arm.command(slowly)
    return found


def test_it_is_a_source(pair: tuple[Arm, Source]) -> None:
    assert isinstance(pair[1], Source)


def test_an_observation_arrives_once_and_after_it_was_taken(
    arrived: list[tuple[float, Instant]],
) -> None:
    assert len(arrived) > 10
    taken = [instant.time_s for _, instant in arrived]
    assert all(time_s <= now_s for time_s, (now_s, _) in zip(taken, arrived, strict=True))
    assert np.all(np.diff(taken) > 0)
    assert np.all(np.diff([instant.index for _, instant in arrived]) > 0)


def test_nothing_new_arrives_without_time(pair: tuple[Arm, Source]) -> None:
    _, source = pair
    source.newest()
    assert source.newest() is None


def test_images_are_those_of_its_cameras(
    pair: tuple[Arm, Source], arrived: list[tuple[float, Instant]]
) -> None:
    cameras = pair[1].cameras
    for _, instant in arrived:
        assert len(instant.images) == len(instant.world_from_camera) == len(cameras)
        assert not instant.is_dark
        for camera, image in zip(cameras, instant.images, strict=True):
            if image is not None:
                assert image.dtype == np.uint8
                assert image.shape[1::-1] == camera.size_px


def test_a_missing_image_is_told_with_the_name_of_its_camera(
    arrived: list[tuple[float, Instant]],
) -> None:
    for _, instant in arrived:
        missing = [
            name for name, image in zip(instant.names, instant.images, strict=True) if image is None
        ]
        assert [any(name in notice for notice in instant.notices) for name in missing] == [
            True
        ] * len(missing)


def test_cameras_are_where_the_arm_says_that_they_were_then() -> None:
    arm, source = in_a_world()
    poses = {0: arm.world_from_cameras(arm.state().positions)}
    for tick in range(1, 60):
        arm.command(np.full(10, 0.2))
        poses[tick] = arm.world_from_cameras(arm.state().positions)
        instant = source.newest()
        if instant is not None:
            before = int(instant.time_s / arm.period_s)
            for eye, pose in enumerate(instant.world_from_camera):
                near = [np.array(poses[at][eye].translation) for at in (before, before + 1)]
                gap = np.linalg.norm(near[1] - near[0])
                assert np.linalg.norm(near[0] - pose.translation) <= gap + 1e-6
                assert np.linalg.norm(near[1] - pose.translation) <= gap + 1e-6

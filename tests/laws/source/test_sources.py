"""What every source of observations must do; a new one is one more line in `SOURCES`."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from played_sources import Played, live, recorded

from servoid.source import Instant, LiveSettings, Source

SECONDS = 1.0


def in_a_world(distortion: tuple[float, ...] = (), **changes: object) -> Played:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    from servoid.sim.world import CameraSettings, ObjectSettings, World, WorldSettings

    cameras = CameraSettings(size_px=(64, 48), samples=1, moments=1, distortion=distortion)
    moving = ObjectSettings(path="sine:0.05@2s")
    settings = {"background": "plain", "cameras": cameras, "object": moving, **changes}
    world = World(WorldSettings(**settings))
    world.start_path()
    slowly = np.full(len(world.arm.joints.names), 0.05)
    return Played(world.source, lambda: world.time_s, lambda: world.arm.command(slowly))


def with_fixed_eyes() -> Played:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    from servoid.sim.world import ArmSettings

    return in_a_world(arm=ArmSettings(turning_eyes=False))


def with_lost_images() -> Played:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    from servoid.sim.world import DropImages

    return in_a_world(
        faults=(DropImages(at_s=0.3, seconds=0.2, camera=0), DropImages(at_s=0.6, seconds=0.2))
    )


def with_a_hanging_camera() -> Played:
    pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
    from servoid.sim.world import FreezeCamera

    return in_a_world(faults=(FreezeCamera(at_s=0.3, seconds=0.3, camera=1),))


SOURCES: dict[str, Callable[[Path], Played]] = {
    "a world": lambda _: in_a_world(),
    "a world with fixed eyes": lambda _: with_fixed_eyes(),
    "a world with lenses that distort": lambda _: in_a_world((-0.2, 0.05, 0.0, 0.0)),
    "a world that loses images": lambda _: with_lost_images(),
    "a world with a camera that hangs": lambda _: with_a_hanging_camera(),
    "a recording": recorded,
    "a recording that arrives late": lambda folder: recorded(folder, latency_s=0.05),
    "a recording at another speed": lambda folder: recorded(folder, rate_hz=55.0),
    "live cameras": lambda _: live(),
    "live cameras with lenses that distort": lambda _: live(distortion=(-0.2, 0.05, 0.0, 0.0)),
    "live cameras with a delay": lambda _: live(settings=LiveSettings(delay_s=0.02)),
    "live cameras of which one loses images": lambda _: live(lost=range(6, 25)),
}


@pytest.fixture(scope="module", params=SOURCES.values(), ids=SOURCES.keys())
def played(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Played]:
    made = request.param(tmp_path_factory.mktemp("source"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def arrived(played: Played) -> list[tuple[float, Instant]]:
    """Return the observations of a second in which the cameras may move, and their arrivals."""
    found = []
    end = played.now() + SECONDS
    while played.now() < end:
        instant = played.source.newest()
        if instant is not None:
            found.append((played.now(), instant))
        played.pass_period()
    return found


def test_it_is_a_source(played: Played) -> None:
    assert isinstance(played.source, Source)


def test_an_observation_arrives_once_and_after_it_was_taken(
    arrived: list[tuple[float, Instant]],
) -> None:
    assert len(arrived) > 10
    taken = [instant.time_s for _, instant in arrived]
    assert all(time_s <= now_s for time_s, (now_s, _) in zip(taken, arrived, strict=True))
    assert np.all(np.diff(taken) > 0)
    assert np.all(np.diff([instant.index for _, instant in arrived]) > 0)


def test_observations_that_nobody_asked_for_are_counted(played: Played) -> None:
    played.source.newest()
    found = []
    end = played.now() + SECONDS
    while played.now() < end:
        for _ in range(20):
            played.pass_period()
        found.append(played.source.newest())
    numbers = [instant.index for instant in found if instant is not None]
    if len(numbers) < 2:
        pytest.skip("this recording is over too soon")
    assert numbers[1] - numbers[0] > 2


def test_nothing_new_arrives_without_time(played: Played) -> None:
    played.source.newest()
    assert played.source.newest() is None


def test_images_are_those_of_its_cameras(
    played: Played, arrived: list[tuple[float, Instant]]
) -> None:
    cameras = played.source.cameras
    assert any(not instant.is_dark for _, instant in arrived)
    for _, instant in arrived:
        assert len(instant.images) == len(instant.world_from_camera) == len(cameras)
        for camera, image in zip(cameras, instant.images, strict=True):
            if image is not None:
                assert image.dtype == np.uint8
                assert image.shape[1::-1] == camera.size_px


def test_a_missing_image_is_told_with_the_name_of_its_camera(
    arrived: list[tuple[float, Instant]],
) -> None:
    for _, instant in arrived:
        assert len(instant.names) == len(instant.images)
        missing = [
            name for name, image in zip(instant.names, instant.images, strict=True) if image is None
        ]
        assert [any(name in notice for notice in instant.notices) for name in missing] == [
            True
        ] * len(missing)

import gc
import sys
import weakref
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servoid.errors import MissingExtraError, SimError
from servoid.pose import Pose
from servoid.shape import Body
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    DropImages,
    FreezeCamera,
    LightSettings,
    ObjectSettings,
    Occlude,
    Recorded,
    Teleport,
    World,
    WorldSettings,
)
from servoid.source import Source

CAMERAS = CameraSettings(size_px=(160, 120), samples=1, moments=1)
REST = np.zeros(10)


def make_world(**changes: object) -> World:
    given = {"background": "plain", "cameras": CAMERAS, "ideal": True, **changes}
    return World(WorldSettings(**given))


def advance(world: World, periods: int, velocities: np.ndarray = REST) -> None:
    for _ in range(periods):
        world.arm.command(velocities)


def look(world: World):
    """Return the next observation of a world whose arm rests."""
    for _ in range(60):
        instant = world.source.newest()
        if instant is not None:
            return instant
        world.arm.command(REST)
    raise AssertionError("no observation arrived")


def centroid(mask: np.ndarray) -> np.ndarray:
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


def test_a_world_that_nobody_holds_is_gone_at_once() -> None:
    look(make_world())  # what is imported for the first world is no part of it
    world = make_world()
    look(world)
    gone = weakref.ref(world)
    gc.disable()
    try:
        del world
        assert gone() is None
    finally:
        gc.enable()


def test_an_arm_outlives_its_world() -> None:
    arm = make_world().arm
    arm.command(REST)
    assert arm.state().time_s > 0.0


def test_the_cameras_of_a_world_are_a_source() -> None:
    world = make_world()
    assert isinstance(world.source, Source)
    assert [camera.size_px for camera in world.cameras] == [(160, 120)] * 2
    width_deg = 2 * np.degrees(np.arctan(80 / world.cameras[0].focal_px[0]))
    assert width_deg == pytest.approx(50.0)


def test_an_image_arrives_when_its_latency_is_over_and_never_before() -> None:
    world = make_world()
    seen = []
    for _ in range(100):
        instant = world.source.newest()
        if instant is not None:
            late = world.time_s - instant.time_s
            assert 0.04 - 1e-9 <= late < 0.04 + world.arm.period_s + 1e-9
            seen.append(instant)
        world.arm.command(REST)
    assert [one.index for one in seen] == list(range(len(seen)))
    assert np.diff([one.time_s for one in seen]) == pytest.approx(np.full(len(seen) - 1, 1 / 30))
    assert len(seen) == 23


def test_observations_that_nobody_asked_for_are_dropped() -> None:
    world = make_world()
    advance(world, 100)
    instant = world.source.newest()
    assert instant is not None
    assert instant.index == 22
    assert world.source.newest() is None


def test_the_poses_of_the_cameras_are_those_of_the_moment_of_the_image() -> None:
    world = make_world()
    turning = np.zeros(10)
    turning[[0, 3, 7, 8]] = 0.3, 0.2, 0.4, -0.3
    states = [world.arm.state()]
    for _ in range(60):
        world.arm.command(turning)
        states.append(world.arm.state())
    instant = world.source.newest()
    assert instant is not None
    times = [state.time_s for state in states]
    angles = [
        np.interp(instant.time_s, times, [state.positions[joint] for state in states])
        for joint in range(10)
    ]
    wanted = world.arm.world_from_cameras(np.array(angles))
    for found, pose in zip(instant.world_from_camera, wanted, strict=True):
        assert np.abs(found.matrix() - pose.matrix()).max() < 1e-4


def test_the_mask_of_an_ellipsoid_is_its_outline_at_the_true_pose() -> None:
    cameras = CameraSettings(size_px=(320, 240), samples=1, moments=1)
    settings = ObjectSettings(name="ellipsoid", path="random:4")
    world = make_world(object=settings, cameras=cameras)
    world.start_path()
    advance(world, 300)
    instant = look(world)
    body = Body(
        world_from_object=world.world_from_object_at(instant.time_s),
        centers=np.zeros((1, 3)),
        radii=np.array([[0.0225, 0.045, 0.0225]]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    for mask, camera, pose in zip(
        world.masks(), world.cameras, instant.world_from_camera, strict=True
    ):
        outline = body.silhouette(camera, pose) > 127
        assert (mask > 0).sum() > 800
        assert ((mask > 0) != outline).sum() <= 0.01 * outline.sum()


def test_the_eyes_start_with_the_object_in_the_middle_of_both_images() -> None:
    world = make_world(object=ObjectSettings(name="ellipsoid"))
    look(world)
    for mask in world.masks():
        assert np.abs(centroid(mask) - (79.5, 59.5)).max() < 0.5
    ahead = make_world(
        object=ObjectSettings(name="ellipsoid"), arm=ArmSettings(eyes_on_object=False)
    )
    look(ahead)
    left, right = (centroid(mask) for mask in ahead.masks())
    assert left[0] > 100
    assert right[0] < 60


def test_the_image_shows_the_object_where_its_mask_is() -> None:
    world = make_world(object=ObjectSettings(name="ellipsoid"))
    for image, mask in zip(look(world).images, world.masks(), strict=True):
        assert image is not None
        red = image[..., 0].astype(int) - image[..., 1] > 40
        assert (red & (mask > 0)).sum() > 0.9 * (mask > 0).sum()
        assert (red & (mask == 0)).sum() < 0.05 * (mask > 0).sum()


def test_the_object_rests_until_its_path_is_started_once() -> None:
    world = make_world(object=ObjectSettings(path="sine:0.1@2s"))
    before = world.world_from_object_at(0.0).matrix()
    advance(world, 50)
    assert np.array_equal(world.world_from_object_at(world.time_s).matrix(), before)
    assert world.twist_at(world.time_s - 0.1) == pytest.approx(np.zeros(6), abs=1e-9)
    world.start_path()
    began = world.time_s
    moved = np.linalg.inv(before) @ world.world_from_object_at(began + 1.0).matrix()
    assert moved[:3, 3] == pytest.approx((0.2, 0.0, 0.0), abs=1e-9)
    quick = world.twist_at(began + 0.5)
    assert np.linalg.norm(quick[:3]) == pytest.approx(0.1 * np.pi, rel=1e-6)
    with pytest.raises(SimError, match="it begins once"):
        world.start_path()


def test_a_path_of_ones_own_takes_the_place_of_the_settings() -> None:
    poses = [Pose.identity(), Pose.exp([0.1, 0, 0, 0, 0, 0.2])]
    settings = WorldSettings(background="plain", cameras=CAMERAS, ideal=True)
    world = World(settings, path=Recorded([3, 4], poses))
    world.start_path()
    moved = world.world_from_object_at(0.0).inverse() @ world.world_from_object_at(1.0)
    assert moved.log() == pytest.approx(poses[1].log(), abs=1e-9)


def test_the_mesh_of_an_object_fills_its_mask() -> None:
    world = make_world(object=ObjectSettings(name="two_ellipsoids", path="still"))
    instant = look(world)
    vertices, faces = world.object_mesh()
    assert faces.max() == len(vertices) - 1
    pose, camera = instant.world_from_camera[0], world.cameras[0]
    in_camera = (pose.inverse() @ world.world_from_object_at(0.0)).transform(vertices)
    pixels = np.rint(camera.project(in_camera)).astype(int)
    rows, columns = np.nonzero(world.masks()[0])
    assert np.abs(pixels.min(axis=0) - (columns.min(), rows.min())).max() <= 1
    assert np.abs(pixels.max(axis=0) - (columns.max(), rows.max())).max() <= 1


def test_no_mask_is_given_before_an_image() -> None:
    with pytest.raises(SimError, match="no observation was handed out"):
        make_world().masks()


def test_the_same_seed_gives_the_same_bits_however_often_one_looks() -> None:
    settings = ObjectSettings(path="random:2")
    driving = np.random.default_rng(1).uniform(-0.3, 0.3, (40, 10))

    def run(often: bool, seed: int, threads: int) -> tuple[np.ndarray, ...]:
        world = make_world(object=settings, seed=seed, threads=threads)
        world.start_path()
        for velocities in driving:
            world.arm.command(velocities)
            if often:
                world.source.newest()
        instant = world.source.newest()
        while instant is None:
            world.arm.command(REST)
            instant = world.source.newest()
        assert instant.images[0] is not None and instant.images[1] is not None
        return (*instant.images, world.arm.state().positions, np.array([instant.time_s]))

    first = run(often=True, seed=3, threads=1)
    again = run(often=True, seed=3, threads=2)
    seldom = run(often=False, seed=3, threads=1)
    other = run(often=True, seed=4, threads=1)
    assert all(np.array_equal(one, two) for one, two in zip(first, again, strict=True))
    assert np.array_equal(first[2], again[2])
    assert not np.array_equal(first[0], other[0])
    # One who looks seldom finds the newest image earlier; the images themselves are the same.
    assert seldom[3] <= first[3]


def test_moving_images_are_blurred_by_a_long_exposure() -> None:
    def edges(exposure_s: float) -> float:
        cameras = CameraSettings(size_px=(160, 120), exposure_s=exposure_s, noise=0.0)
        settings = ObjectSettings(name="ellipsoid", path="sine:0.1@0.8s")
        world = make_world(object=settings, cameras=cameras)
        world.start_path()
        advance(world, 25)
        image = look(world).images[0]
        assert image is not None
        return float(np.abs(np.diff(image[..., 0].astype(float), axis=1)).max())

    assert edges(0.03) < 0.6 * edges(0.001)


def test_a_lens_that_bends_lines_delivers_images_of_a_pinhole() -> None:
    bent = CameraSettings(size_px=(320, 240), samples=2, noise=0.0, distortion=(-0.2, 0.05, 0, 0))
    straight = CameraSettings(size_px=(320, 240), samples=2, noise=0.0)
    places = []
    for cameras in (bent, straight):
        world = make_world(
            object=ObjectSettings(name="ellipsoid"),
            cameras=cameras,
            arm=ArmSettings(eyes_on_object=False),
        )
        instant = look(world)
        image = instant.images[0]
        assert image is not None
        red = image[..., 0].astype(int) - image[..., 1] > 40
        camera, pose = world.cameras[0], instant.world_from_camera[0]
        point = pose.inverse() @ world.world_from_object_at(0.0)
        wanted = camera.project(np.array([point.translation]))[0]
        places.append(np.abs(centroid(red) - wanted).max())
    assert max(places) < 1.0


def test_noise_has_the_strength_that_was_asked_for() -> None:
    def picture(noise: float) -> np.ndarray:
        cameras = CameraSettings(size_px=(160, 120), samples=1, moments=1, noise=noise)
        image = look(make_world(cameras=cameras)).images[0]
        assert image is not None
        return image.astype(float)

    assert np.std(picture(3.0) - picture(0.0)) == pytest.approx(3.0, rel=0.05)


def test_the_light_changes_after_the_path_began() -> None:
    light = LightSettings(step_at_s=0.2, step_to=0.5)
    world = make_world(light=light)
    before = look(world).images[0]
    advance(world, 40)
    still = look(world).images[0]
    world.start_path()
    advance(world, 45)
    after = look(world).images[0]
    assert before is not None and still is not None and after is not None
    assert abs(before.mean() - still.mean()) < 1.0
    assert after.mean() < 0.85 * before.mean()


def test_a_dropped_camera_is_missing_and_dropped_observations_never_arrive() -> None:
    faults = (
        DropImages(at_s=0.2, seconds=0.2, camera=1),
        DropImages(at_s=0.6, seconds=0.3),
    )
    world = make_world(faults=faults)
    world.start_path()
    times = []
    for _ in range(150):
        instant = world.source.newest()
        if instant is not None:
            times.append(instant.time_s)
            gone = 0.2 <= instant.time_s < 0.4
            assert (instant.images[1] is None) == gone
            assert bool(instant.notices) == gone
            assert instant.images[0] is not None
        world.arm.command(REST)
    assert [time for time in times if 0.6 <= time < 0.9] == []
    assert [time for time in times if time > 0.9] != []


def test_a_frozen_camera_repeats_its_image_with_new_times() -> None:
    world = make_world(
        faults=(FreezeCamera(at_s=0.3, seconds=0.4, camera=0),),
        object=ObjectSettings(path="sine:0.05@2s"),
    )
    world.start_path()
    images = {}
    for _ in range(120):
        instant = world.source.newest()
        if instant is not None:
            images[instant.time_s] = instant.images
        world.arm.command(REST)
    times = sorted(images)
    for before, after in pairwise(times):
        same = [np.array_equal(a, b) for a, b in zip(images[before], images[after], strict=True)]
        assert same == [0.3 <= after < 0.7, False]


def test_a_board_hides_the_object_while_it_is_there() -> None:
    world = make_world(faults=(Occlude(at_s=0.5, seconds=1.5),))
    world.start_path()
    look(world)
    free = world.masks()
    advance(world, 120)
    world.source.newest()
    hidden = world.masks()
    advance(world, 180)
    world.source.newest()
    again = world.masks()
    assert [mask.any() for mask in hidden] == [False, False]
    assert all(np.array_equal(a, b) for a, b in zip(free, again, strict=True))


def test_boards_of_different_sizes_are_refused() -> None:
    small = Occlude(at_s=3.0, seconds=1.0, half_size=(0.05, 0.05))
    with pytest.raises(SimError, match="give all Occlude faults the same half_size"):
        make_world(faults=(Occlude(at_s=0.5, seconds=1.5), small))


def test_the_largest_seed_is_as_good_as_any() -> None:
    assert look(make_world(seed=2**64 - 1)).images[0] is not None


def test_a_teleport_moves_the_object_at_once() -> None:
    world = make_world(
        faults=(Teleport(at_s=0.5, by=(0.1, -0.02, 0.03), turn=(0.0, 0.4, 0.0)),),
        object=ObjectSettings(path="line:0.1@2s"),
    )
    world.start_path()
    before, after = world.world_from_object_at(0.4999), world.world_from_object_at(0.5001)
    moved = before.inverse() @ after
    assert moved.translation == pytest.approx((0.1, -0.02, 0.03), abs=1e-4)
    assert moved.log()[3:] == pytest.approx((0.0, 0.4, 0.0), abs=1e-9)


def test_the_overview_has_the_size_that_was_asked_for_and_shows_the_object() -> None:
    world = make_world(object=ObjectSettings(name="ellipsoid"))
    picture = world.overview((200, 150))
    assert picture.shape == (150, 200, 3)
    red = picture[..., 0].astype(int) - picture[..., 1] > 50
    assert 20 < red.sum() < 2000


def test_a_missing_engine_is_named_with_the_extra_that_brings_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"servoid\[sim\]"):
        make_world()

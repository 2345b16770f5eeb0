"""What is off in a laboratory: each error by itself, as large as it was asked for."""

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from hypothesis import given
from hypothesis import strategies as st

from servoid.camera import Camera
from servoid.errors import SimError
from servoid.sim.world import (
    IDEAL,
    CameraSettings,
    LabSettings,
    LightSettings,
    ObjectSettings,
    World,
    WorldSettings,
    hand_drawn,
)
from servoid.sim.world.lab import Lab
from servoid.source import Instant

CAMERAS = CameraSettings(size_px=(64, 48), samples=1, moments=1, noise=0.0)
TRUE = Camera(size_px=(640, 480), focal_px=(700.0, 700.0), center_px=(319.5, 239.5))
SEEDS = range(400)
MOVING = ObjectSettings(name="ellipsoid", path="sine:0.1@1s")


def lab_with(**values: Any) -> LabSettings:
    """Return a laboratory in which nothing is off but what is named."""
    return msgspec.structs.replace(IDEAL, **values)


def make_world(lab: LabSettings, **changes: Any) -> World:
    given = {"background": "plain", "cameras": CAMERAS, "object": MOVING, "threads": 1}
    return World(WorldSettings(**{**given, "lab": lab, **changes}))


def drawn(value: Callable[[Lab], Any], **values: Any) -> np.ndarray:
    """Draw by many seeds what a laboratory has with one error alone."""
    return np.array([value(Lab(lab_with(**values), seed)) for seed in SEEDS])


SIZES: dict[str, tuple[Callable[[Lab], Any], dict[str, float], float]] = {
    "hand-eye, m": (lambda lab: lab.head_from_true.translation, {"hand_eye_m": 0.002}, 0.002),
    "hand-eye, deg": (
        lambda lab: np.degrees(lab.head_from_true.log()[3:]),
        {"hand_eye_deg": 0.3},
        0.3,
    ),
    "stereo, m": (lambda lab: lab.right_from_true.translation, {"stereo_m": 0.001}, 0.001),
    "stereo, deg": (
        lambda lab: np.degrees(lab.right_from_true.log()[3:]),
        {"stereo_deg": 0.1},
        0.1,
    ),
    "zeros": (lambda lab: np.degrees(lab.zeros(10, 7)[7:]), {"eye_zeros_deg": 0.2}, 0.2),
    "focal": (lambda lab: lab.camera(TRUE, 1).focal_px[0] / 700.0 - 1.0, {"focal": 0.01}, 0.01),
    "center": (
        lambda lab: np.subtract(lab.camera(TRUE, 0).center_px, TRUE.center_px),
        {"center_px": 2.0},
        2.0,
    ),
    "encoder": (lambda lab: lab.angle_noise(10, 3), {"encoder": 1e-3}, 1e-3),
    "encoder speed": (lambda lab: lab.speed_noise(10, 3), {"encoder_speed": 0.1}, 0.1),
    "stamp offset": (lambda lab: lab.stamp_error(5), {"stamp_offset_s": 0.01}, 0.01),
    "stamp jitter": (lambda lab: lab.stamp_error(5), {"stamp_jitter_s": 0.002}, 0.002),
    "masses": (lambda lab: lab.mass_shares(8) - 1.0, {"masses": 0.05}, 0.05),
}


@pytest.mark.parametrize("name", SIZES)
def test_what_is_drawn_is_as_large_as_it_was_asked_for(name: str) -> None:
    value, settings, size = SIZES[name]
    found = drawn(value, **settings)
    count = found.size
    assert np.sqrt(np.mean(found**2)) == pytest.approx(size, rel=4.0 / np.sqrt(2.0 * count))
    assert abs(found.mean()) < 4.5 * size / np.sqrt(count)


@given(st.integers(0, 2**64 - 1))
def test_in_an_ideal_laboratory_nothing_is_off(seed: int) -> None:
    lab = Lab(IDEAL, seed)
    assert lab.head_from_true is None and lab.right_from_true is None
    assert lab.camera(TRUE, 0).focal_px == TRUE.focal_px
    assert lab.camera(TRUE, 1).center_px == TRUE.center_px
    assert not lab.zeros(10, 7).any() and not lab.angle_noise(10, 4).any()
    assert lab.stamp_error(3) == 0.0 and (lab.mass_shares(9) == 1.0).all()


@given(st.integers(0, 2**64 - 1))
def test_the_arm_has_no_wrong_zeros_but_the_eyes_have(seed: int) -> None:
    zeros = Lab(LabSettings(), seed).zeros(10, 7)
    assert not zeros[:7].any() and zeros[7:].all()


def test_an_offset_of_stamps_is_one_and_the_same_and_jitter_is_not() -> None:
    offset, jitter = (
        [Lab(lab_with(**{name: 0.003}), 7).stamp_error(index) for index in range(5)]
        for name in ("stamp_offset_s", "stamp_jitter_s")
    )
    assert len(set(offset)) == 1 and len(set(jitter)) == 5


def seen_by(world: World) -> tuple[Instant, dict[str, Any]]:
    """Drive for a while, and return the newest observation and what there is to know of it."""
    world.start_path()
    turning = np.full(10, 0.2)
    for _ in range(50):
        world.arm.command(turning)
    instant = world.source.newest()
    while instant is None:
        world.arm.command(turning)
        instant = world.source.newest()
    state = world.arm.state()
    return instant, {
        "images": [image for image in instant.images if image is not None],
        "true joints": world.world_from_hand_at(world.time_s).matrix(),
        "true views": [pose.matrix() for _, pose in world.true_views()],
        "angles": state.positions,
        "speeds": state.velocities,
        "believed views": [pose.matrix() for pose in instant.world_from_camera],
        "cameras": [(one.focal_px, one.center_px) for one in world.cameras],
        "stamp": instant.time_s - world.true_time_s(),
        "eyes": [
            *world.arm.eyes.hand_from_head.translation,  # pyright: ignore[reportOptionalMemberAccess]
            world.arm.eyes.half_baseline,  # pyright: ignore[reportOptionalMemberAccess]
        ],
    }


BELIEVED = "believed views"
PLANT = {"images", "true joints", "true views", "angles", "speeds", BELIEVED}
CHANGES: dict[str, tuple[dict[str, Any], set[str]]] = {
    "hand-eye": ({"hand_eye_m": 0.003, "hand_eye_deg": 0.2}, {BELIEVED, "eyes"}),
    "stereo": ({"stereo_m": 0.003, "stereo_deg": 0.2}, {BELIEVED, "eyes"}),
    "zeros": ({"eye_zeros_deg": 0.2}, {"angles", BELIEVED}),
    "focal": ({"focal": 0.01}, {"cameras"}),
    "center": ({"center_px": 1.0}, {"cameras", BELIEVED}),
    "encoder": ({"encoder": 1e-3, "read_once": True}, {"angles", BELIEVED}),
    "encoder speed": ({"encoder_speed": 0.1}, {"speeds"}),
    "stamps": ({"stamp_offset_s": 0.01, "stamp_jitter_s": 0.002}, {"stamp", BELIEVED}),
    "masses": ({"masses": 0.1}, PLANT),
    "friction": ({"friction": 0.1}, PLANT),
    "mask": ({"mask_px": 3.0}, set()),
}


@pytest.fixture(scope="module")
def ideal() -> dict[str, Any]:
    return seen_by(make_world(IDEAL))[1]


@pytest.mark.parametrize("name", CHANGES)
def test_each_error_changes_what_it_should_and_nothing_else(
    ideal: dict[str, Any], name: str
) -> None:
    settings, changed = CHANGES[name]
    _, found = seen_by(make_world(lab_with(**settings)))
    assert {key for key in ideal if not np.array_equal(ideal[key], found[key])} == changed


def test_a_world_that_is_called_ideal_is_one_whatever_its_laboratory(
    ideal: dict[str, Any],
) -> None:
    _, found = seen_by(make_world(LabSettings(), ideal=True))
    assert [key for key in ideal if not np.array_equal(ideal[key], found[key])] == []


def test_the_same_seed_draws_the_same_laboratory_and_another_another() -> None:
    first, again, other = (seen_by(make_world(LabSettings(), seed=seed))[1] for seed in (3, 3, 4))
    assert [key for key in first if not np.array_equal(first[key], again[key])] == []
    assert set(CHANGES) and not np.array_equal(first["cameras"], other["cameras"])


def test_a_reading_is_the_same_however_often_it_is_read() -> None:
    world = make_world(LabSettings())
    world.arm.command(np.full(10, 0.1))
    first, again = world.arm.state(), world.arm.state()
    assert np.array_equal(first.positions, again.positions)
    assert np.array_equal(first.velocities, again.velocities)


def test_between_readings_joints_are_taken_to_turn_evenly() -> None:
    world = make_world(lab_with(read_once=True))
    states = [world.arm.state()]
    for _ in range(40):
        world.arm.command(np.linspace(-0.4, 0.4, 10))
        states.append(world.arm.state())
    instant = world.source.newest()
    assert instant is not None
    times = [state.time_s for state in states]
    angles = [
        np.interp(instant.time_s, times, [one.positions[joint] for one in states])
        for joint in range(10)
    ]
    for found, pose in zip(
        instant.world_from_camera, world.arm.world_from_cameras(np.array(angles)), strict=True
    ):
        assert np.abs(found.matrix() - pose.matrix()).max() < 1e-9


def test_what_is_straight_ahead_is_seen_there_whatever_the_principal_point() -> None:
    world = make_world(lab_with(center_px=2.0))
    instant, _ = seen_by(world)
    views = zip(world.true_views(), world.cameras, instant.world_from_camera, strict=True)
    for (true, true_pose), camera, pose in views:
        ahead = true_pose.transform(np.array([[0.0, 0.0, 0.6]]))
        seen = camera.project(pose.inverse().transform(ahead))[0]
        assert np.abs(np.subtract(camera.center_px, true.center_px)).max() > 0.5
        assert np.abs(seen - true.center_px).max() < 0.05


def test_stamps_grow_whatever_their_jitter() -> None:
    world = make_world(
        lab_with(stamp_jitter_s=0.01),
        cameras=msgspec.structs.replace(CAMERAS, rate_hz=125.0),
    )
    times = []
    for _ in range(150):
        world.arm.command(np.zeros(10))
        instant = world.source.newest()
        times += [] if instant is None else [instant.time_s]
    assert len(times) > 100
    assert (np.diff(times) > 0.0).all()


def test_an_arm_that_weighs_otherwise_rests_where_it_is_and_follows_its_speeds() -> None:
    world = make_world(lab_with(masses=0.1, friction=0.05))
    before = world.arm.state().positions
    for _ in range(60):
        world.arm.command(np.zeros(10))
    assert np.abs(world.arm.state().positions - before).max() < 1e-6
    speeds = np.array([0.1, -0.1, 0.1, 0.1, -0.1, 0.1, 0.1, 0.1, 0.1, 0.1])
    for _ in range(60):
        world.arm.command(speeds)
    assert np.abs(world.arm.state().velocities - speeds).max() < 0.005


def handed_out(tracking: bool) -> tuple[list[float], list[int]]:
    """Return how old observations are when they are handed out, and their numbers."""
    world = make_world(lab_with(track_s=0.003, search_s=0.045))
    world.source.tracking = tracking
    ages, numbers = [], []
    for _ in range(150):
        world.arm.command(np.zeros(10))
        instant = world.source.newest()
        if instant is not None:
            ages.append(world.time_s - instant.time_s)
            numbers.append(instant.index)
    return ages, numbers


def test_a_tracker_that_searches_gets_older_images_and_misses_some() -> None:
    latency_s, period_s = CAMERAS.latency_s, 0.008
    ages, numbers = handed_out(tracking=True)
    assert latency_s + 0.003 - 1e-9 <= min(ages)
    assert max(ages) < latency_s + 0.003 + period_s + 1e-9
    assert set(np.diff(numbers)) == {1}
    ages, numbers = handed_out(tracking=False)
    assert latency_s + 0.045 - 1e-9 <= min(ages)
    # It begins with the newest image once it is done with the last.
    assert max(ages) < latency_s + 0.045 + 1.0 / 30.0 + 2.0 * period_s
    assert max(np.diff(numbers)) == 2


def picture(world: World, periods: int = 60) -> np.ndarray:
    for _ in range(periods):
        world.arm.command(np.zeros(10))
    instant = world.source.newest()
    assert instant is not None and instant.images[0] is not None
    return instant.images[0].astype(float)


def test_rows_that_are_read_out_in_turn_see_a_world_at_rest_as_at_once() -> None:
    still = ObjectSettings(name="ellipsoid")
    pictures = [
        picture(make_world(lab_with(readout_s=readout_s), object=still))
        for readout_s in (0.0, 0.02)
    ]
    assert np.abs(pictures[0] - pictures[1]).max() <= 1.0


def test_what_moves_sideways_leans_as_far_as_it_goes_while_rows_are_read_out() -> None:
    cameras = msgspec.structs.replace(CAMERAS, size_px=(320, 240))
    leans = []
    for readout_s in (0.0, 0.02):
        world = make_world(lab_with(readout_s=readout_s), cameras=cameras)
        world.start_path()
        image = picture(world, 37).astype(int)
        rows, columns = np.nonzero(image[..., 0] - image[..., 1] > 40)
        middles = [(row, columns[rows == row].mean()) for row in np.unique(rows)]
        leans.append(np.polyfit(*np.transpose(middles), 1)[0])
    depth, focal = 0.545, world.cameras[0].focal_px[0]
    speed = float(np.linalg.norm(world.twist_at(world.true_time_s())[:3]))
    assert speed > 0.5
    wanted = speed * focal / depth * 0.02 / 240
    assert leans[1] - leans[0] == pytest.approx(wanted, rel=0.25)


def test_an_image_that_takes_too_long_is_refused() -> None:
    with pytest.raises(SimError, match=r"take 0\.046 s, but at 30 Hz .* lower lab\.readout_s"):
        make_world(lab_with(readout_s=0.04))
    make_world(lab_with(readout_s=0.04), ideal=True)


@pytest.mark.parametrize(
    ("name", "value"), [("hand_eye_m", -0.001), ("focal", 0.5), ("stamp_jitter_s", 1.0)]
)
def test_a_laboratory_that_cannot_be_is_refused(name: str, value: float) -> None:
    with pytest.raises(SimError, match=rf"LabSettings\.{name}: expected a number"):
        LabSettings(**{name: value})


def test_exposure_that_is_controlled_leaves_a_constant_scene_as_it_is() -> None:
    still = ObjectSettings(name="ellipsoid")
    fixed, controlled = (
        picture(make_world(lab_with(auto_exposure_s=seconds), object=still))
        for seconds in (0.0, 0.5)
    )
    assert np.array_equal(fixed, controlled)


def dimmed(seconds: float, periods: int, often: bool) -> float:
    """Return how bright an image is so long after the light has become weaker."""
    world = make_world(
        lab_with(auto_exposure_s=seconds),
        object=ObjectSettings(name="ellipsoid"),
        light=LightSettings(step_at_s=0.1, step_to=0.5),
    )
    world.start_path()
    for _ in range(periods):
        world.arm.command(np.zeros(10))
        if often:
            world.source.newest()
    return float(picture(world).mean())


def test_exposure_follows_the_light_slowly_whether_anybody_looks_or_not() -> None:
    before = picture(make_world(IDEAL, object=ObjectSettings(name="ellipsoid"))).mean()
    fixed, soon, late = (dimmed(*given, often=True) for given in ((0.0, 0), (0.8, 0), (0.2, 300)))
    assert fixed < soon < 0.97 * before
    assert late == pytest.approx(before, rel=0.02)
    assert dimmed(0.8, 0, often=False) == soon


def test_a_steady_hand_draws_what_is_there() -> None:
    mask = np.zeros((48, 64), np.uint8)
    mask[10:30, 20:50] = 255
    assert np.array_equal(hand_drawn(mask, 0.0, 3), mask)
    assert not np.array_equal(hand_drawn(mask, 2.0, 3), mask)
    assert np.array_equal(hand_drawn(mask, 2.0, 3), hand_drawn(mask, 2.0, 3))


@pytest.mark.parametrize("px", [1.5, 4.0])
def test_a_hand_strays_from_an_outline_by_as_much_as_was_asked_for(px: float) -> None:
    mask = np.zeros((600, 120), np.uint8)
    mask[:, :60] = 255
    edges = np.concatenate([(hand_drawn(mask, px, seed) > 0).sum(axis=1) for seed in range(12)])
    assert edges.mean() == pytest.approx(60.0, abs=0.5)
    assert edges.std() == pytest.approx(px, rel=0.2)

"""Cameras of a recording whose images are of different times are told by what moves."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tiers import tiered
from true_captures import TRUE_CAPTURES, true_capture

from servoid.camera import Camera
from servoid.capture import (
    Capture,
    PosedImage,
    capture_of,
    doubt_calibration,
    doubt_for_model,
    doubt_step,
)
from servoid.capture.lag_fit import MovingFeatures, fit_lag
from servoid.pose import Pose
from servoid.sim import MovingScene, Scenario
from servoid.track import Subject, track_capture

SIZE_PX = (320, 240)
RATE_HZ = 25.0
PAIRS = [name for name in TRUE_CAPTURES if name.startswith(("stereo/", "hard/"))]
UNSEEN = "hard/sugar_jump"  # jumps too far between images, so that its lag is not found
Image = NDArray[np.uint8]


def texture(size_px: tuple[int, int], seed: int) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).uniform(0.0, 255.0, size_px[::-1]).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2.0)
    return 128.0 + 6.0 * (smooth - smooth.mean())


WALL, SHEET = texture(SIZE_PX, 0), texture((120, 90), 1)


def image_of(shift_px: float, at_px: tuple[float, float]) -> Image:
    """Draw a sheet of print in front of a wall; the sheet is seen at a place in the left image."""
    matrix = np.array([[1.0, 0.0, -0.4 * shift_px], [0.0, 1.0, 0.0]])
    drawn = cv2.warpAffine(WALL, matrix, SIZE_PX, borderMode=cv2.BORDER_REFLECT)
    matrix = np.array([[1.0, 0.0, at_px[0] - shift_px], [0.0, 1.0, at_px[1]]])
    moved = cv2.warpAffine(SHEET, matrix, SIZE_PX)
    there = cv2.warpAffine(np.ones_like(SHEET), matrix, SIZE_PX)
    pixels = np.clip(there * moved + (1.0 - there) * drawn, 0.0, 255.0)
    return np.repeat(pixels.astype(np.uint8)[..., None], 3, axis=2)


def tilted(image: Image, by_px: float) -> Image:
    """Return what a camera sees once it was tilted so far."""
    matrix = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, by_px]])
    return np.asarray(
        cv2.warpAffine(image, matrix, SIZE_PX, borderMode=cv2.BORDER_REFLECT), np.uint8
    )


def pair(
    late: float, *, along_px: float, across_px: float, tilt_px: float = 0.0, since: int = 0
) -> Capture:
    """Draw a parallel pair whose right camera is `late` images behind since an observation.

    It may be tilted meanwhile.
    """

    def place(time: float) -> tuple[float, float]:
        swing = np.sin(0.3 * time)
        return 110.0 + along_px * swing, 75.0 + across_px * swing

    camera = Camera(size_px=SIZE_PX, focal_px=(300.0, 300.0), center_px=(159.5, 119.5))
    observations = [
        [
            PosedImage(
                camera=camera,
                world_from_camera=Pose(pose),
                image=tilted(image_of(shift, at), tilt),
            )
            for pose, shift, at, tilt in (
                (np.eye(4), 0.0, place(float(index)), 0.0),
                (
                    shifted(0.1),
                    30.0,
                    place(index - late * (index >= since)),
                    tilt_px * (index >= 8),
                ),
            )
        ]
        for index in range(20)
    ]
    made = capture_of(observations, rate_hz=RATE_HZ)
    names = ("left", "right")
    cameras = [replace(one, name=name) for one, name in zip(made.cameras, names, strict=True)]
    return replace(made, cameras=tuple(cameras))


def shifted(x_m: float) -> NDArray[np.float64]:
    pose = np.eye(4)
    pose[0, 3] = x_m
    return pose


def recorded(offsets: Sequence[float], *, count: int = 16, hand: bool = False) -> Capture:
    """Record a moving toy with parallel cameras beside each other."""
    scene = MovingScene(Scenario(count=count, size="small", hand=hand))
    scene.offsets = tuple(offsets)
    observations = []
    for index in range(count):
        look = scene.look(index)
        seen = [
            PosedImage(camera=scene.camera, world_from_camera=Pose(pose), image=image)
            for image, pose in zip(look.images, scene.room_from_cameras(index), strict=True)
        ]
        seen[0] = replace(seen[0], mask=look.mask)
        observations.append(seen)
    made = capture_of(observations, rate_hz=30.0)
    names = ("left", "right", "third")
    cameras = [replace(one, name=name) for one, name in zip(made.cameras, names, strict=False)]
    return replace(made, cameras=tuple(cameras))


def lagging(capture: Capture, images: int, place: int = 1) -> Capture:
    """Let one camera deliver the images that it took that many observations before."""
    count = len(capture)
    kept = range(max(images, 0), count + min(images, 0))
    cameras = []
    for at, camera in enumerate(capture.cameras):
        late = images if at == place else 0
        lists = {
            name: tuple(values[index - late] for index in kept)
            for name in ("pictures", "mask_paths", "depth_paths", "masks", "depths_m")
            if (values := getattr(camera, name))
        }
        cameras.append(replace(camera, **lists))
    times = capture.times_s
    return replace(
        capture,
        cameras=tuple(cameras),
        world_from_rig=tuple(capture.world_from_rig[index] for index in kept),
        times_s=None if times is None else tuple(times[index] for index in kept),
    )


@pytest.fixture(scope="module")
def three() -> Capture:
    return recorded((0.0, 0.1, -0.1))


@pytest.fixture(scope="module")
def still(three: Capture) -> Capture:
    return replace(three, cameras=three.cameras[:2])


@pytest.mark.parametrize(
    ("images", "said"),
    tiered(
        [
            (1, "camera right is 33 ms (1.0 images) behind camera left: "),
            (-2, "camera left is 67 ms (2.0 images) behind camera right: "),
            (2, "camera right is 67 ms (2.0 images) behind camera left: "),
            (-1, "camera left is 33 ms (1.0 images) behind camera right: "),
        ],
        quick=2,
    ),
)
def test_a_camera_that_is_late_is_named_with_its_lag(
    images: int, said: str, still: Capture
) -> None:
    doubt = doubt_step(lagging(still, images))
    assert doubt is not None
    about = [said.split()[1], f"({abs(images)}.0 images)"]
    assert all(word in doubt for word in about) and doubt.split(" is ")[0] == said.split(" is ")[0]
    late_ms = float(doubt.split(" is ")[1].split(" ms")[0])
    assert late_ms == pytest.approx(1000.0 * abs(images) / 30.0, abs=4.0)
    word = "image" if abs(images) == 1 else "images"
    assert f"that comes {abs(images)} {word} later, or synchronise the cameras" in doubt


def test_cameras_in_step_are_not_doubted(still: Capture) -> None:
    assert doubt_step(still) is None
    assert doubt_step(pair(0.0, along_px=25.0, across_px=25.0)) is None


def test_a_lag_of_half_an_image_is_named_and_no_whole_image_makes_up_for_it() -> None:
    doubt = doubt_step(pair(-0.5, along_px=5.0, across_px=20.0))
    assert doubt is not None and doubt.startswith("camera left is ")
    assert "(0.5 images) behind camera right" in doubt
    assert "that comes" not in doubt and doubt.endswith("; synchronise the cameras")


@pytest.mark.extended
def test_what_moves_along_the_epipolar_lines_only_or_rests_says_nothing() -> None:
    assert doubt_step(pair(1.0, along_px=20.0, across_px=20.0)) is not None
    assert doubt_step(pair(1.0, along_px=25.0, across_px=0.0)) is None
    assert doubt_step(pair(1.0, along_px=0.0, across_px=0.0)) is None


@pytest.mark.parametrize("late", [-1.0, 1.0])
def test_a_camera_that_dropped_an_image_is_late_from_there_on(late: float) -> None:
    doubt = doubt_step(pair(late, along_px=5.0, across_px=20.0, since=10))
    assert doubt is not None
    found = re.search("behind camera (left|right) from about observation ([0-9]+) on, but", doubt)
    assert found is not None
    assert (found[1], int(found[2])) in {("left" if late > 0.0 else "right", at) for at in (10, 11)}
    always = doubt_step(pair(late, along_px=5.0, across_px=20.0))
    assert always is not None and "from" not in always.split(":")[0]


@pytest.mark.parametrize("tilt_px", [-5.0, 5.0])
def test_a_camera_that_was_moved_meanwhile_is_not_told_as_late(tilt_px: float) -> None:
    moved = pair(0.0, along_px=5.0, across_px=20.0, tilt_px=tilt_px)
    assert doubt_step(moved) is None
    doubt = doubt_calibration(moved)
    assert doubt is not None and doubt.startswith("a camera was moved meanwhile")


def test_photographs_and_few_observations_are_not_examined(still: Capture) -> None:
    late = lagging(still, 1)
    assert doubt_step(replace(late, rate_hz=None)) is None
    assert doubt_step(late, among=[0, 5, 6]) is None
    assert doubt_step(late, among=range(2, 12)) is not None
    assert doubt_step(replace(late, cameras=late.cameras[:1])) is None


def test_the_lag_in_milliseconds_follows_from_the_times(still: Capture) -> None:
    late = lagging(still, 1)
    slow = replace(late, times_s=tuple(0.2 * index for index in range(len(late))))
    doubt = doubt_step(slow)
    assert doubt is not None
    assert float(doubt.split(" is ")[1].split(" ms")[0]) == pytest.approx(200.0, abs=20.0)


def test_a_wrong_pose_of_a_camera_is_no_lag(still: Capture) -> None:
    for twist in ([0.0, 0.0, 0.0, 0.01, 0.0, 0.0], [0.0, 0.004, 0.0, 0.0, 0.0, 0.02]):
        left, right = still.cameras
        moved = replace(right, rig_from_camera=right.rig_from_camera @ Pose.exp(twist))
        assert doubt_step(replace(still, cameras=(left, moved))) is None


def test_a_late_camera_of_three_is_named_beside_the_first_that_sees_the_same(
    three: Capture,
) -> None:
    assert doubt_step(three) is None
    doubt = doubt_step(lagging(three, 1, place=2))
    assert doubt is not None and doubt.startswith("camera third is ")
    assert "(1.0 images) behind camera left: " in doubt


@pytest.mark.parametrize(("images",), tiered([1, 0, -1]))
def test_a_rig_that_moves_shows_a_late_camera_by_all_that_it_sees(images: int) -> None:
    doubt = doubt_step(lagging(recorded((0.0, 0.1), hand=True, count=24), images))
    assert (doubt is not None) == (images != 0)


def test_a_track_and_a_model_of_a_late_camera_are_in_doubt(still: Capture) -> None:
    late = lagging(still, -1)
    assert late.cameras[0].masks[0] is not None
    doubt = doubt_for_model(late)
    assert doubt is not None and "behind camera right" in doubt
    [right] = track_capture(still)
    known = Subject(body=right.body, start=right.estimates[0].world_from_object)
    [wrong] = track_capture(late, [known])
    assert (right.step_doubt, right.verdict) == (None, "good")
    assert wrong.step_doubt is not None and wrong.verdict != "good"
    assert wrong.notices_on_all[-1] == "the cameras are out of step"
    assert wrong.capture_doubts == (wrong.step_doubt,)


def features(lag: float, speeds: NDArray[np.float64], seed: int) -> MovingFeatures:
    """Return features off their lines by a lag and by a wrong pose, with noise."""
    random = np.random.default_rng(seed)
    places = random.uniform(-1.0, 1.0, (len(speeds), 3))
    wrong = 1.0 + places @ [0.5, -0.4, 0.8]
    noise = 0.2 * random.normal(size=len(speeds)) + 0.1 * random.normal()
    return MovingFeatures(lag * speeds + wrong + noise, speeds, places)


def test_a_lag_is_told_from_what_a_wrong_pose_puts_off_the_lines() -> None:
    random = np.random.default_rng(7)
    for lag in (0.0, 0.5, -1.0, 3.0):
        seen = [features(lag, random.normal(0.0, 3.0, 60), seed) for seed in range(6)]
        fit = fit_lag(seen)
        assert fit.images == pytest.approx(lag, abs=0.05) and fit.error < 0.03
        assert fit.extremes[0] <= fit.images <= fit.extremes[1]
        assert fit.shifted(2).images == pytest.approx(2.0 + lag, abs=0.05)


def test_wrong_matches_do_not_move_a_lag() -> None:
    random = np.random.default_rng(8)
    seen = []
    for seed in range(6):
        one = features(1.0, random.normal(0.0, 3.0, 60), seed)
        wrong = random.uniform(size=60) < 0.1
        off = np.where(wrong, random.uniform(-9.0, 9.0, 60), one.off)
        seen.append(replace(one, off=off))
    assert fit_lag(seen).images == pytest.approx(1.0, abs=0.1)


def test_the_standard_error_of_a_lag_is_that_of_repeated_recordings() -> None:
    random = np.random.default_rng(9)
    fits = [
        fit_lag(
            [
                features(1.0, random.normal(2.0, 0.5, 30) * random.choice([-1, 1]), 100 * run + at)
                for at in range(8)
            ]
        )
        for run in range(60)
    ]
    spread = float(np.std([fit.images for fit in fits]))
    usual = float(np.median([fit.error for fit in fits]))
    assert 0.5 * spread < usual < 2.0 * spread


@pytest.mark.extended
@pytest.mark.parametrize("images", [0, 1, -1, 2, -2])
@pytest.mark.parametrize("name", PAIRS)
def test_recorded_pairs_are_doubted_only_if_one_camera_is_late(name: str, images: int) -> None:
    doubt = doubt_step(lagging(true_capture(name), images))
    if images == 0 or name == UNSEEN:
        assert doubt is None
        return
    late, other = ("right", "left") if images > 0 else ("left", "right")
    assert doubt is not None
    assert doubt.startswith(f"camera {late} is ") and f"behind camera {other}: " in doubt


def test_a_recorded_pair_with_a_late_camera_is_doubted() -> None:
    capture = true_capture("hard/mug_sway")
    assert Path(capture.path).exists()
    assert doubt_step(capture) is None
    doubt = doubt_step(lagging(capture, 1))
    assert doubt is not None and "(1.0 images) behind camera left" in doubt

"""What is a value compares, is written short, and can be copied, pickled and sent elsewhere."""

import copy
import pickle
import re
from multiprocessing import get_context

import numpy as np
import pytest

from servoid._native import OneStepSettings
from servoid.camera import Camera, Lens
from servoid.capture import View
from servoid.errors import ServoidError
from servoid.model import ModelSettings, PaperSettings, Request, fit
from servoid.pose import Pose
from servoid.servo import ServoSettings
from servoid.shape import Body
from servoid.track import Estimate, Tracker, TrackSettings

POSE = Pose.from_euler("xyz", [0.123456789, 0.2, 0.3], [0.1, 1e-9 / 3, 12345.678901])
CAMERA = Camera.from_fov((160, 120), 61.2345678)
LENS = Lens.from_matrix(CAMERA.matrix(), (160, 120), [0.1, 0.0, 1e-3 / 3, 0.0])
BODY = Body(
    world_from_object=Pose.from_parts([0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]),
    centers=[[0.0, 0.0, 0.0], [0.01, 0.02, 0.03]],
    radii=[[0.1, 0.08, 0.06], [0.03, 0.02, 0.01]],
    rotations=[[1, 0, 0, 0], POSE.quaternion],
)
MASK = BODY.silhouette(CAMERA, Pose.identity())
VIEW = View(camera=CAMERA, world_from_camera=Pose.identity(), mask=MASK)


def estimate() -> Estimate:
    tracker = Tracker(CAMERA, BODY)
    image = np.where(MASK, np.uint8(200), np.uint8(40))
    tracker.start(0.0, Pose.identity(), image, BODY.world_from_object)
    return tracker.step(0.1, Pose.identity(), image)


VALUES = [
    POSE,
    CAMERA,
    LENS,
    BODY,
    VIEW,
    estimate(),
    TrackSettings(seed=3),
    ModelSettings(max_ellipsoids=5, quick=True),
    PaperSettings(alpha_m=0.01),
]
NAMED = pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)


@NAMED
def test_a_copy_is_equal_and_hashes_alike(value: object) -> None:
    for made in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))):
        assert made == value
        assert hash(made) == hash(value)
        assert repr(made) == repr(value)
    assert value not in (None, 3, "a")
    assert len({value: 1, copy.deepcopy(value): 2}) == 1


@NAMED
def test_a_value_is_written_on_one_line_with_six_digits_at_most(value: object) -> None:
    text = repr(value)
    assert text.startswith(type(value).__name__)
    assert len(text) < 200
    assert "\n" not in text
    for number in re.findall(r"\d+\.?\d*", text):
        assert len(number.replace(".", "").lstrip("0")) <= 6, text


def test_other_numbers_are_other_values() -> None:
    assert Pose.identity() == Pose(np.eye(4))
    assert Pose.identity() != POSE
    assert Camera.from_fov((160, 120), 61.0) != CAMERA
    assert ModelSettings(quick=True) != ModelSettings()
    assert ModelSettings(quick=True) == copy.copy(ModelSettings(quick=True))
    half = Pose.from_parts([0, 0, 0], [0, 1, 0, 0]), Pose.from_parts([0, 0, 0], [-0.0, -1, 0, 0])
    assert half[0] == half[1]
    assert hash(half[0]) == hash(half[1])


def test_a_pickled_value_has_the_same_bits() -> None:
    chain = POSE
    for _ in range(50):
        chain = chain @ POSE
    again = pickle.loads(pickle.dumps(chain))
    assert again.matrix().tobytes() == chain.matrix().tobytes()
    body = pickle.loads(pickle.dumps(BODY))
    assert body.rotations.tobytes() == BODY.rotations.tobytes()
    seen = estimate()
    assert pickle.loads(pickle.dumps(seen)).covariance.tobytes() == seen.covariance.tobytes()
    assert pickle.loads(pickle.dumps(seen)).seconds == seen.seconds


def test_a_result_and_settings_can_be_copied_and_pickled() -> None:
    views = [VIEW, View(camera=CAMERA, world_from_camera=side(), mask=side_mask())]
    result = fit(views, max_ellipsoids=1)
    for made in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert made.body == result.body
        assert made.steps == result.steps
        assert (made.used_views[0].mask() == result.used_views[0].mask()).all()
    for value in (Request(seed=1), ServoSettings()):
        assert pickle.loads(pickle.dumps(value)) == value


def side() -> Pose:
    return Pose.from_euler("y", [-np.pi / 2], [0.5, 0.0, 0.5])


def side_mask() -> np.ndarray:
    return BODY.silhouette(CAMERA, side())


def moved(parts: tuple[Pose, Camera, Body, Estimate]) -> tuple[Pose, Camera, Body, Estimate]:
    pose, camera, body, seen = parts
    return pose.inverse(), camera, body, seen


def test_values_go_to_other_processes_and_come_back() -> None:
    parts = (POSE, CAMERA, BODY, estimate())
    with get_context("spawn").Pool(1) as pool:
        [back] = pool.map(moved, [parts])
    assert back == (POSE.inverse(), *parts[1:])


@pytest.mark.parametrize(
    ("kind", "name", "wrong", "words"),
    [
        (ModelSettings, "max_ellipsoids", -1, "a whole number, 0 or more, but -1"),
        (ModelSettings, "delta", "little", "a number, but 'little'"),
        (ModelSettings, "seed", 2.5, "a whole number from 0 to .*, but 2.5"),
        (PaperSettings, "alpha", [0.1], "a number, but a list of 1"),
        (TrackSettings, "adjust", "yes", "True or False, but 'yes'"),
        (TrackSettings, "budget_s", "short", "a number, but 'short'"),
        (OneStepSettings, "points", -3, "a whole number, 0 or more, but -3"),
    ],
)
def test_a_setting_of_another_kind_is_refused_by_its_name(
    kind: type, name: str, wrong: object, words: str
) -> None:
    with pytest.raises(ServoidError, match=f"^{name} must be {words} was given$"):
        kind(**{name: wrong})


def test_a_tracker_says_that_it_is_no_value() -> None:
    with pytest.raises(TypeError, match="Tracker"):
        pickle.dumps(Tracker(CAMERA, BODY))

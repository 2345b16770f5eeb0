"""CameraInfo as lenses: each model against OpenCV, and parts of images against whole ones."""

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import Info, calibration_of
from servoid.pose import Pose

SIZE_PX = (640, 480)
K = np.array([[520.0, 0, 322.5], [0, 530.0, 238.25], [0, 0, 1]])
MODELS = {
    "plumb_bob": (-0.21, 0.07, 0.001, -0.002, 0.01),
    "rational_polynomial": (-0.2, 0.06, 0.001, -0.002, 0.01, 0.1, 0.02, 0.003),
    "equidistant": (0.02, -0.01, 0.004, -0.001),
}


def info(**changes: Any) -> Info:
    """Make a CameraInfo of ROS 2, of which single fields are told."""
    fields = {
        "width": SIZE_PX[0],
        "height": SIZE_PX[1],
        "distortion_model": "plumb_bob",
        "d": (),
        "k": K.ravel(),
        "r": np.eye(3).ravel(),
        "p": np.zeros(12),
        "binning_x": 0,
        "binning_y": 0,
        "roi": SimpleNamespace(x_offset=0, y_offset=0),
        **changes,
    }
    return Info.of(SimpleNamespace(**fields), "left")


def points(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-0.5, 0.5, (20, 2)), rng.uniform(0.9, 1.5, 20)])


@pytest.mark.parametrize("model", MODELS)
@given(seed=st.integers(0, 1000))
def test_a_raw_image_is_seen_as_opencv_projects_with_k_and_d(model: str, seed: int) -> None:
    d = np.array(MODELS[model])
    lens = calibration_of(info(distortion_model=model, d=d), SIZE_PX, "a", is_rectified=False).lens
    seen = points(seed)
    if model == "equidistant":
        expected, _ = cv2.fisheye.projectPoints(seen[None], np.zeros(3), np.zeros(3), K, d)
        expected = expected[0]
    else:
        expected = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), K, d)[0][:, 0]
    assert np.abs(lens.project(seen) - expected).max() < 1e-9


@given(angles=st.tuples(*[st.floats(-0.1, 0.1)] * 3), seed=st.integers(0, 1000))
def test_rectifying_with_opencv_and_reading_p_is_the_same_as_reading_k_d_and_r(
    angles: tuple[float, float, float], seed: int
) -> None:
    """A point in the camera's frame is seen in the rectified image where R and P put it."""
    r = Pose.from_euler("xyz", angles).matrix()[:3, :3]
    p = np.array([[500.0, 0, 318, -60.0], [0, 500.0, 241, 0], [0, 0, 1, 0]])
    message = info(d=MODELS["plumb_bob"], r=r.ravel(), p=p.ravel())
    raw = calibration_of(message, SIZE_PX, "a", is_rectified=False)
    rectified = calibration_of(message, SIZE_PX, "a", is_rectified=True)
    seen = points(seed)
    expected = cv2.undistortPoints(raw.lens.project(seen), K, np.array(message.d), R=r, P=p[:, :3])
    in_rectified = rectified.frame_from_camera.inverse().transform(seen)
    assert np.abs(rectified.lens.project(in_rectified) - expected[:, 0]).max() < 1e-2
    assert raw.frame_from_camera == Pose.identity() and rectified.lens.model == "pinhole"
    assert rectified.shift_m == (pytest.approx(0.12), 0.0)


@given(left=st.integers(0, 100), top=st.integers(0, 80), by=st.sampled_from([1, 2, 4]))
def test_a_part_of_the_image_and_joined_pixels_see_the_same_rays(
    left: int, top: int, by: int
) -> None:
    whole = calibration_of(info(), SIZE_PX, "a", is_rectified=False).lens
    size = ((SIZE_PX[0] - left) // by, (SIZE_PX[1] - top) // by)
    region = SimpleNamespace(x_offset=left, y_offset=top)
    message = info(roi=region, binning_x=by, binning_y=by)
    if (left, top) == (0, 0):
        size = (SIZE_PX[0] // by, SIZE_PX[1] // by)
    part = calibration_of(message, size, "a", is_rectified=False).lens
    seen = points(1)
    # The middle of a joined pixel lies between the middles of its parts.
    expected = (whole.project(seen) - (left, top) - (by - 1) / 2.0) / by
    assert np.abs(part.project(seen) - expected).max() < 1e-9


def test_fields_of_ros_1_are_read_by_their_other_names() -> None:
    fields = {"D": MODELS["plumb_bob"], "K": K.ravel(), "R": np.eye(3).ravel(), "P": np.zeros(12)}
    old = SimpleNamespace(
        width=640,
        height=480,
        distortion_model="plumb_bob",
        binning_x=0,
        binning_y=0,
        roi=SimpleNamespace(x_offset=0, y_offset=0),
        **fields,
    )
    message = Info.of(old, "left")
    assert message.is_like(info(d=MODELS["plumb_bob"]))
    assert not message.is_like(info(d=(*MODELS["plumb_bob"][:4], 0.02)))


@pytest.mark.parametrize(
    ("changes", "is_rectified", "words"),
    [
        ({"k": np.zeros(9)}, False, "has no focal length"),
        ({"d": MODELS["plumb_bob"]}, True, "is not valid for rectified images: its P is zero"),
        ({"d": (1.0, 2.0, 3.0)}, False, "distortion_model is 'plumb_bob' with 3 coefficients"),
        (
            {"distortion_model": "rational_polynomial", "d": (0.1,) * 12},
            False,
            "D has 12 coefficients; servoid supports the first 8 of 'rational_polynomial'",
        ),
    ],
)
def test_a_calibration_that_says_too_little_is_refused_in_words(
    changes: dict[str, Any], is_rectified: bool, words: str
) -> None:
    with pytest.raises(CaptureError) as caught:
        calibration_of(info(**changes), SIZE_PX, "run.bag, /camera_info", is_rectified=is_rectified)
    assert str(caught.value).startswith("run.bag, /camera_info") and words in str(caught.value)

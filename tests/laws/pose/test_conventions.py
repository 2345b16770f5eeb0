"""Other people's conventions: OpenCV's, ROS's and SciPy's."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from servoid.camera import Camera, Lens
from servoid.errors import CameraError, PoseError
from servoid.pose import Pose

K = np.array([[500.0, 0.0, 320.0], [0.0, 501.0, 240.0], [0.0, 0.0, 1.0]])
POINTS = np.array([[0.1, -0.2, 1.0], [-0.3, 0.1, 1.5], [0.2, 0.2, 0.9]])
SEQUENCES = [a + b + c for a in "xyz" for b in "xyz" for c in "xyz" if a != b != c]
ANGLE = st.floats(-3.1, 3.1)


def test_a_camera_projects_as_opencv_does_and_gives_its_matrix_back() -> None:
    camera = Camera.from_matrix(K, (640, 480))
    expected, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), K, None)
    assert np.allclose(camera.project(POINTS), expected[:, 0])
    assert (camera.matrix() == K).all()
    assert camera == Camera.from_matrix(K.tolist(), [640, 480], np.zeros((1, 5)))


@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_a_lens_distorts_as_opencv_does(count: int) -> None:
    bent = np.array([0.1, -0.05, 0.001, 0.002, 0.01, 0.02, 0.01, 0.005] + [0.0] * 6)[:count]
    lens = Lens.from_matrix(K, (640, 480), bent.reshape(-1, 1))
    expected, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), K, bent)
    assert np.allclose(lens.project(POINTS), expected[:, 0], atol=1e-9)
    assert (lens.matrix() == K).all()


def test_a_fisheye_distorts_as_opencv_does() -> None:
    bent = np.array([0.05, -0.01, 0.002, -0.001])
    lens = Lens.from_matrix(K, (640, 480), bent, fisheye=True)
    expected, _ = cv2.fisheye.projectPoints(POINTS[:, None], np.zeros(3), np.zeros(3), K, bent)
    assert np.allclose(lens.project(POINTS), expected[:, 0], atol=1e-9)


def test_an_angle_of_view_reaches_from_border_to_border() -> None:
    camera = Camera.from_fov((640, 480), 90.0)
    assert np.allclose(camera.focal_px, 320.0)
    assert np.allclose(camera.project([[-1.0, 0.0, 1.0]]), [[-0.5, 239.5]])
    with pytest.raises(CameraError, match="less than 180 degrees, but it is 180"):
        Camera.from_fov((640, 480), 180.0)
    with pytest.raises(
        CameraError, match=r"hardly any lens \(in radians it would be 65\.0 degrees"
    ):
        Camera.from_fov((640, 480), np.radians(65.0))
    with pytest.raises(
        CameraError, match=r"hardly any lens; if it is right, give the focal length"
    ):
        Camera.from_fov((640, 480), 0.01)


@pytest.mark.parametrize("focal_px", [(4.4, 4.4), (0.7, 0.9), (500.0, 0.0044)])
def test_a_focal_length_in_millimetres_or_shares_of_the_width_is_no_number_of_pixels(
    focal_px: tuple[float, float],
) -> None:
    place = (319.5, 239.5)
    for model, bends in (
        ("pinhole", ()),
        ("brown_conrady", (0.0,) * 4),
        ("kannala_brandt", (0.0,) * 4),
    ):
        with pytest.raises(
            CameraError, match=r"must be in pixels, .* covers 1[78]\d degrees; one in m"
        ):
            Lens(
                model=model,
                size_px=(640, 480),
                focal_px=focal_px,
                center_px=place,
                distortion=bends,
            )


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(4), "3x4 projection"),
        ([[500, 2, 320], [0, 501, 240], [0, 0, 1]], "without skew"),
        (K * 2, "its last number is 1"),
        ("K", "but 'K' was given"),
    ],
)
def test_what_is_no_matrix_of_a_camera_is_refused(matrix: object, words: str) -> None:
    with pytest.raises(CameraError, match=words):
        Camera.from_matrix(matrix, (640, 480))  # type: ignore[arg-type]


def test_a_camera_refuses_a_distortion_that_a_lens_would_take() -> None:
    with pytest.raises(CameraError, match=r"Lens\.from_matrix"):
        Camera.from_matrix(K, (640, 480), [0.1, 0.0, 0.0, 0.0])
    with pytest.raises(CameraError, match="4, 5 or 8 distortion coefficients"):
        Lens.from_matrix(K, (640, 480), [0.1] * 12)


@given(st.tuples(ANGLE, ANGLE, ANGLE))
def test_a_rotation_vector_is_opencvs(rvec: tuple[float, float, float]) -> None:
    pose = Pose.from_rvec_tvec(np.array(rvec).reshape(3, 1), [1, 2, 3])
    assert np.allclose(pose.matrix()[:3, :3], cv2.Rodrigues(np.array(rvec))[0], atol=1e-9)
    again = Pose.from_rvec_tvec(*pose.rvec_tvec())
    assert np.allclose(again.matrix(), pose.matrix(), atol=1e-12)


@given(st.tuples(ANGLE, ANGLE, ANGLE))
def test_a_quaternion_in_the_order_of_ros_is_scipys(rvec: tuple[float, float, float]) -> None:
    turn = Rotation.from_rotvec(rvec)
    pose = Pose.from_xyzw([1.0, 2.0, 3.0], turn.as_quat())
    assert np.allclose(pose.matrix()[:3, :3], turn.as_matrix())
    again = Pose.from_xyzw(pose.translation, pose.xyzw)
    assert np.allclose(again.matrix(), pose.matrix(), atol=1e-15)
    assert pose.xyzw == (*pose.quaternion[1:], pose.quaternion[0])


@pytest.mark.parametrize("sequence", [*SEQUENCES, *(name.upper() for name in SEQUENCES)])
def test_angles_are_scipys(sequence: str) -> None:
    for turn in Rotation.random(50, random_state=np.random.default_rng(7)):
        pose = Pose.from_xyzw([0, 0, 0], turn.as_quat())
        angles = pose.euler(sequence)
        assert np.allclose(angles, turn.as_euler(sequence), atol=1e-9)
        assert np.allclose(Pose.from_euler(sequence, angles).matrix(), pose.matrix())


@pytest.mark.parametrize("sequence", [*SEQUENCES, *(name.upper() for name in SEQUENCES)])
@pytest.mark.filterwarnings("ignore:Gimbal lock")
def test_locked_angles_are_scipys(sequence: str) -> None:
    for middle in (0.0, np.pi) if sequence[0] == sequence[2] else (np.pi / 2, -np.pi / 2):
        turn = Rotation.from_euler(sequence, [0.3, middle, 0.5])
        angles = Pose.from_xyzw([0, 0, 0], turn.as_quat()).euler(sequence)
        assert angles[2] == 0.0
        assert np.allclose(Rotation.from_euler(sequence, angles).as_matrix(), turn.as_matrix())


@pytest.mark.parametrize(
    ("sequence", "angles", "words"),
    [
        ("xx", [1, 2], "none twice in a row"),
        ("xY", [1, 2], "lower case"),
        ("", [], "one to three"),
        ("abc", [1, 2, 3], "'abc'"),
        ("xyz", [1, 2], "3 axes, but angles are a list of 2"),
        ("x", [np.nan], "finite"),
        ("xyz", [0.0, -90.0, 0.0], "an angle is 90.0, .* for degrees, give degrees=True"),
    ],
)
def test_what_are_no_angles_is_refused(sequence: str, angles: list[float], words: str) -> None:
    with pytest.raises(PoseError, match=words):
        Pose.from_euler(sequence, angles)


def test_angles_in_degrees_are_those_in_radians_and_come_back() -> None:
    pose = Pose.from_euler("xyz", [30, -45, 350], degrees=True)
    assert pose == Pose.from_euler("xyz", np.radians([30, -45, 350]))
    assert pose.euler("xyz", degrees=True) == pytest.approx([30, -45, -10])


def test_a_rotation_vector_in_degrees_is_refused() -> None:
    with pytest.raises(PoseError, match=r"length of rvec is 90\.0, .* give np\.radians"):
        Pose.from_rvec_tvec([90, 0, 0], [0, 0, 1])


def test_poses_take_lists_and_any_kind_of_number() -> None:
    identity = Pose.identity()
    for kind in (np.int8, np.uint64, np.float16, np.float32, np.longdouble):
        assert Pose(np.eye(4, dtype=kind)) == identity
        assert identity.transform(np.ones((2, 3), kind)).dtype == np.float64
    assert Pose(np.eye(4).tolist()) == identity
    assert identity.transform([1, 2, 3]).tolist() == [1.0, 2.0, 3.0]
    assert identity.transform([]).shape == (0, 3)


@pytest.mark.parametrize(
    "wrong",
    [None, "a", 3, [[1, 2], [3]], np.eye(3), np.eye(4, dtype=bool), np.eye(4) * 1j, object()],
    ids=["nothing", "text", "number", "ragged", "3x3", "bool", "complex", "object"],
)
def test_what_is_no_pose_is_refused_as_such(wrong: object) -> None:
    with pytest.raises(PoseError):
        Pose(wrong)  # type: ignore[arg-type]
    with pytest.raises(PoseError):
        Pose.from_parts(wrong, [1, 0, 0, 0])  # type: ignore[arg-type]


def test_points_are_not_joined_to_poses() -> None:
    for wrong in (np.zeros(3), [0, 0, 0], np.eye(4)):
        with pytest.raises(PoseError, match=r"pose\.transform\(points\)"):
            _ = Pose.identity() @ wrong  # type: ignore[operator]
    with pytest.raises(PoseError, match="joins two poses"):
        _ = np.eye(4) @ Pose.identity()
    with pytest.raises(TypeError):
        _ = Pose.identity() @ 3  # type: ignore[operator]

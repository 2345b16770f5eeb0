"""Lenses and the ideal cameras that replace them, against OpenCV and against drawn ellipsoids."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.camera import Camera, Lens, Undistortion, undistortion
from servoid.errors import CameraError, ImageError, MaskError
from servoid.pose import Pose
from servoid.shape import Body

SIZE_PX = (640, 480)
FOCAL_PX = (420.0, 430.0)
CENTER_PX = (322.5, 236.0)
MATRIX = np.array([[FOCAL_PX[0], 0, CENTER_PX[0]], [0, FOCAL_PX[1], CENTER_PX[1]], [0, 0, 1.0]])
BROWN = (
    (-0.28, 0.09, 1.2e-3, -0.8e-3),
    (-0.28, 0.09, 1.2e-3, -0.8e-3, -0.012),
    (0.3, -0.05, -2e-3, 1e-3, 0.01, 0.35, -0.02, 0.004),
    (0.15, 0.05, 3e-3, -4e-3, 0.02),
)
KANNALA = ((0.0, 0.0, 0.0, 0.0), (-0.02, 0.004, -0.003, 0.0005), (0.06, 0.01, -0.002, 0.0003))
Pixels = NDArray[np.float64]


def brown(coefficients: tuple[float, ...], **changes: object) -> Lens:
    known = {"size_px": SIZE_PX, "focal_px": FOCAL_PX, "center_px": CENTER_PX}
    return Lens(model="brown_conrady", distortion=coefficients, **{**known, **changes})


def fisheye(coefficients: tuple[float, ...], **changes: object) -> Lens:
    known = {"size_px": SIZE_PX, "focal_px": FOCAL_PX, "center_px": CENTER_PX}
    return Lens(model="kannala_brandt", distortion=coefficients, **{**known, **changes})


def wide_fisheye() -> Lens:
    """Make a fisheye whose picture holds all of 190 degrees."""
    return fisheye(KANNALA[1], size_px=(900, 900), focal_px=(270.0, 270.0), center_px=(449.5, 447))


def every_pixel(size_px: tuple[int, int]) -> Pixels:
    u, v = np.meshgrid(np.arange(size_px[0]), np.arange(size_px[1]))
    return np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64)


def points_before(limit: float, seed: int = 3) -> NDArray[np.float64]:
    """Return points, (N, 3), up to an angle off the axis, at distances from 0.2 to 5 m."""
    rng = np.random.default_rng(seed)
    angle, turn = rng.uniform(0.0, limit, 500), rng.uniform(0.0, 2.0 * np.pi, 500)
    rays = [np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]
    return np.stack(rays, axis=1) * rng.uniform(0.2, 5.0, (500, 1))


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize("coefficients", BROWN)
def test_brown_conrady_projects_as_opencv_does_and_back(coefficients: tuple[float, ...]) -> None:
    lens = brown(coefficients)
    points = points_before(min(0.95 * lens.limit, np.radians(60.0)))
    pixels = lens.project(points)
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, np.array(coefficients))
    np.testing.assert_allclose(pixels, theirs[:, 0], atol=1e-9)
    np.testing.assert_allclose(lens.rays(pixels), unit(points), atol=1e-9)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-13)
    near = pixels[np.abs(pixels - CENTER_PX).max(axis=1) < 200.0]
    flat = cv2.undistortPointsIter(
        near[:, None], MATRIX, np.array(coefficients), np.eye(3), np.eye(3), stop
    )
    rays = lens.rays(near)
    np.testing.assert_allclose(rays[:, :2] / rays[:, 2:], flat[:, 0], atol=1e-9)


@pytest.mark.parametrize("coefficients", KANNALA)
def test_kannala_brandt_projects_as_opencv_does_and_back(coefficients: tuple[float, ...]) -> None:
    lens = fisheye(coefficients)
    points = points_before(np.radians(89.0))
    pixels = lens.project(points)
    theirs, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), MATRIX, np.array(coefficients)
    )
    np.testing.assert_allclose(pixels, theirs[:, 0], atol=1e-8)
    np.testing.assert_allclose(lens.rays(pixels), unit(points), atol=1e-9)
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14)
    near = pixels[np.linalg.norm(points[:, :2], axis=1) < 5.0 * points[:, 2]]
    flat = cv2.fisheye.undistortPoints(near[:, None], MATRIX, np.array(coefficients), criteria=stop)
    rays = lens.rays(near)
    np.testing.assert_allclose(rays[:, :2] / rays[:, 2:], flat[:, 0], rtol=1e-7, atol=1e-8)


def test_a_fisheye_of_180_degrees_and_more_is_seen_to_its_edge() -> None:
    lens = wide_fisheye()
    k1, k2, k3, k4 = KANNALA[1]
    angles = np.radians([60.0, 89.99, 90.0, 90.01, 95.0])
    points = np.stack([np.sin(angles), np.zeros(5), np.cos(angles)], axis=1)
    far = angles * (1 + k1 * angles**2 + k2 * angles**4 + k3 * angles**6 + k4 * angles**8)
    pixels = lens.project(points)
    np.testing.assert_allclose(pixels[:, 0], 449.5 + 270.0 * far)
    np.testing.assert_allclose(lens.rays(pixels), points, atol=1e-10)
    assert 449.5 + 270.0 * far[-1] < 899.5


def test_beyond_the_limit_opencv_draws_ghosts_and_servoid_sees_nothing() -> None:
    coefficients = (-0.3, 0.0, 0.0, 0.0)
    lens = brown(coefficients)
    angles = np.array([0.99, 1.01]) * lens.limit
    points = np.stack([np.sin(angles), np.zeros(2), np.cos(angles)], axis=1)
    theirs, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), MATRIX, np.array(coefficients))
    assert (np.abs(theirs[:, 0] - CENTER_PX) < (320, 240)).all()
    assert np.isfinite(lens.project(points)[0]).all()
    assert np.isnan(lens.project(points)[1]).all()
    # No ray leads to a place outside all that the lens shows.
    assert np.isnan(lens.rays(np.array([[CENTER_PX[0] + 0.75 * FOCAL_PX[0], CENTER_PX[1]]]))).all()


def textured(size_px: tuple[int, int]) -> NDArray[np.uint8]:
    rng = np.random.default_rng(11)
    small = rng.integers(0, 256, (size_px[1] // 16, size_px[0] // 16, 3)).astype(np.uint8)
    return np.asarray(cv2.resize(small, size_px, interpolation=cv2.INTER_CUBIC), dtype=np.uint8)


def pinhole_like(lens: Lens) -> Undistortion:
    camera = Camera(size_px=lens.size_px, focal_px=lens.focal_px, center_px=lens.center_px)
    return Undistortion(camera, Pose.identity(), lens.map_to(camera, Pose.identity()), lens)


@pytest.mark.parametrize("coefficients", BROWN)
def test_pictures_are_straightened_as_by_cv2_undistort(coefficients: tuple[float, ...]) -> None:
    image = textured(SIZE_PX)
    ours = pinhole_like(brown(coefficients)).image(image).astype(int)
    theirs = cv2.undistort(image, MATRIX, np.array(coefficients)).astype(int)
    # Both round to 1/32 of a pixel, each in its own way, also at the picture's edge.
    assert np.percentile(np.abs(ours - theirs), 99.5) <= 6
    assert np.abs(ours - theirs).mean() < 0.5


@pytest.mark.parametrize("coefficients", KANNALA)
def test_pictures_are_straightened_as_by_cv2_fisheye(coefficients: tuple[float, ...]) -> None:
    image = textured(SIZE_PX)
    ours = pinhole_like(fisheye(coefficients)).image(image).astype(int)
    distortion = np.array(coefficients)
    theirs = cv2.fisheye.undistortImage(image, MATRIX, distortion, None, MATRIX).astype(int)
    assert np.percentile(np.abs(ours - theirs), 99.5) <= 6
    assert np.abs(ours - theirs).mean() < 0.5


# Drawn ellipsoids: rays come from OpenCV or from a table, not from the lens under test.


def brown_rays(lens: Lens) -> NDArray[np.float64]:
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    pixels, (fx, fy), (cx, cy) = every_pixel(lens.size_px), lens.focal_px, lens.center_px
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    distortion = np.array(lens.distortion)
    flat = cv2.undistortPointsIter(pixels[:, None], matrix, distortion, np.eye(3), np.eye(3), stop)[
        :, 0
    ]
    return unit(np.concatenate([flat, np.ones((len(flat), 1))], axis=1))


def fisheye_rays(lens: Lens) -> NDArray[np.float64]:
    angles = np.linspace(0.0, np.radians(100.0), 20001)
    powers = angles[:, None] ** np.array([3, 5, 7, 9])
    flat = (every_pixel(lens.size_px) - lens.center_px) / lens.focal_px
    far = np.linalg.norm(flat, axis=1)
    angle = np.interp(far, angles + powers @ np.array(lens.distortion), angles)
    across = flat * (np.sin(angle) / np.maximum(far, 1e-12))[:, None]
    return np.concatenate([across, np.cos(angle)[:, None]], axis=1)


def ellipsoid_at(center: NDArray[np.float64]) -> tuple[Body, NDArray[np.float64]]:
    """Return an ellipsoid as a body in the world and as a matrix A with (x - c)ᵀ A (x - c) = 1."""
    radii, turn = np.array([0.16, 0.1, 0.07]), Rotation.from_euler("xyz", (0.4, -0.7, 0.2))
    x, y, z, w = turn.as_quat()
    body = Body(
        world_from_object=Pose.identity(),
        centers=center[None],
        radii=radii[None],
        rotations=np.array([[w, x, y, z]]),
    )
    return body, turn.as_matrix() @ np.diag(radii**-2.0) @ turn.as_matrix().T


def distances(
    rays: NDArray[np.float64], center: NDArray[np.float64], shape: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far along each ray, (N, 3), the ellipsoid is met: NaN where it is missed."""
    a = np.einsum("ni,ij,nj->n", rays, shape, rays)
    b, c = rays @ shape @ center, center @ shape @ center - 1.0
    root = np.sqrt(np.where(b * b > a * c, b * b - a * c, np.nan))
    return np.where(b > 0.0, (b - root) / a, np.nan)


def off_axis(degrees: float, turn: float, far: float) -> NDArray[np.float64]:
    angle = np.radians(degrees)
    ray = [np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)]
    return far * np.array(ray)


def overlap(one: NDArray[np.uint8], two: NDArray[np.uint8]) -> float:
    return np.count_nonzero(one & two) / np.count_nonzero(one | two)


@pytest.mark.parametrize(("degrees", "turn"), [(0.0, 0.0), (45.0, 2.0), (80.0, 0.3), (80.0, -2.2)])
def test_an_object_anywhere_in_a_fisheye_has_the_outline_of_a_pinhole(
    degrees: float, turn: float
) -> None:
    lens, center = wide_fisheye(), off_axis(degrees, turn, 0.6)
    body, shape = ellipsoid_at(center)
    seen = ~np.isnan(distances(fisheye_rays(lens), center, shape))
    mask = seen.reshape(lens.size_px[::-1]).astype(np.uint8)
    ideal = undistortion(lens, every_pixel(lens.size_px)[seen])
    made = ideal.mask(mask)
    assert set(np.unique(made)) == {0, 255}
    assert overlap(made, body.silhouette(ideal.camera, ideal.lens_from_camera)) > 0.98
    # As many pixels as the lens has there, to within what one pinhole can do.
    assert 0.7 < np.count_nonzero(made) / np.count_nonzero(mask) < 1.6


@pytest.mark.parametrize("coefficients", BROWN)
def test_an_object_in_a_distorted_picture_has_the_outline_of_a_pinhole(
    coefficients: tuple[float, ...],
) -> None:
    lens, center = brown(coefficients), off_axis(22.0, 0.5, 0.7)
    body, shape = ellipsoid_at(center)
    mask = ~np.isnan(distances(brown_rays(lens), center, shape)).reshape(SIZE_PX[::-1])
    ideal = undistortion(lens)
    assert overlap(ideal.mask(mask), body.silhouette(ideal.camera, Pose.identity())) > 0.98


@pytest.mark.parametrize(("degrees", "turn"), [(10.0, 0.0), (75.0, 0.3)])
def test_depth_becomes_depth_along_the_axis_of_the_turned_camera(
    degrees: float, turn: float
) -> None:
    lens, center = wide_fisheye(), off_axis(degrees, turn, 0.6)
    body, shape = ellipsoid_at(center)
    rays = fisheye_rays(lens)
    far = distances(rays, center, shape)
    depth = (far * rays[:, 2]).reshape(lens.size_px[::-1])
    depth[:440] = np.where(np.isnan(depth[:440]), 0.0, depth[:440])
    ideal = undistortion(lens, every_pixel(lens.size_px)[~np.isnan(far)])
    made = ideal.depth(depth)
    width, height = ideal.camera.size_px
    ahead = every_pixel((width, height)) - ideal.camera.center_px
    ahead = np.concatenate([ahead / ideal.camera.focal_px, np.ones((width * height, 1))], axis=1)
    turned = ideal.lens_from_camera.transform(ahead)
    true = distances(turned, center, shape).reshape(height, width)
    # Where the surface is seen at a steep angle, the nearest pixel lies elsewhere on it.
    inside = cv2.erode(body.silhouette(ideal.camera, ideal.lens_from_camera), np.ones((9, 9))) > 0
    assert np.median(np.abs(made - true)[inside]) < 1e-3
    assert np.abs(made - true)[inside].max() < 0.01
    outside = cv2.dilate(body.silhouette(ideal.camera, ideal.lens_from_camera), np.ones((9, 9))) < 1
    assert (np.isnan(made[outside]) | (made[outside] == 0.0)).all()
    assert ideal.depth(depth.astype(np.float32)).dtype == np.float32


# The choice of the ideal camera.


@pytest.mark.parametrize("coefficients", BROWN)
def test_the_whole_distorted_picture_is_covered(coefficients: tuple[float, ...]) -> None:
    lens = brown(coefficients)
    ideal = undistortion(lens)
    pixels = ideal.camera.project(lens.rays(every_pixel(SIZE_PX)))
    assert (pixels >= 0.0).all()
    assert (pixels <= np.array(ideal.camera.size_px) - 1.0).all()
    assert ideal.camera.focal_px == FOCAL_PX
    assert np.allclose(ideal.lens_from_camera.matrix(), np.eye(4))


def test_pictures_along_the_axis_are_bounded() -> None:
    ideal = undistortion(wide_fisheye())
    corner = (np.array(ideal.camera.size_px) - 1.0 - ideal.camera.center_px) / ideal.camera.focal_px
    np.testing.assert_allclose(np.degrees(np.arctan(corner)), 60.0, atol=0.2)
    beside = brown((-0.02, 1e-4, 0.0, 0.0), focal_px=(120.0, 900.0))
    assert max(undistortion(beside).camera.size_px) <= 2 * max(SIZE_PX)
    large = brown((0.2, 0.1, 0.0, 0.0), size_px=(8000, 600), focal_px=(6000.0, 6000.0))
    assert max(undistortion(large).camera.size_px) <= Camera.MAX_SIDE_PX


def test_a_brown_conrady_camera_turns_only_to_what_its_picture_would_cut_off() -> None:
    # So wide that the corners lie more than 60 degrees off the axis.
    lens = brown((1e-3, 0.0, 0.0, 0.0), focal_px=(150.0, 150.0))
    near, corner = np.array([[300.0, 200], [310, 260]]), np.array([[2.0, 2], [12, 10]])
    along = undistortion(lens)
    assert undistortion(lens, near).camera.size_px == along.camera.size_px
    assert np.allclose(undistortion(lens, near).lens_from_camera.matrix(), np.eye(4))
    turned = undistortion(lens, corner)
    assert turned.lens_from_camera.log()[3:] @ turned.lens_from_camera.log()[3:] > 0.5
    rays = turned.lens_from_camera.inverse().transform(lens.rays(corner))
    pixels = turned.camera.project(rays)
    assert ((pixels > 0) & (pixels < turned.camera.size_px)).all()


@settings(max_examples=40, deadline=None)
@given(
    degrees=st.floats(0.0, 92.0), turn=st.floats(0.0, 6.3), half=st.floats(0.1, 58.0),
    growth=st.sampled_from(KANNALA),
)  # fmt: skip
def test_a_turned_camera_holds_the_whole_object(
    degrees: float, turn: float, half: float, growth: tuple[float, ...]
) -> None:
    lens = fisheye(growth)
    cone = Rotation.from_euler("yz", (degrees, np.degrees(turn)), degrees=True)
    rays = cone.apply([off_axis(half, angle, 1.0) for angle in np.linspace(0.0, 6.0, 24)])
    pixels = lens.project(np.ascontiguousarray(rays))
    seen = ~np.isnan(pixels[:, 0])
    ideal = undistortion(lens, pixels)
    assert ideal.map_px is not None
    inside = ideal.camera.project(ideal.lens_from_camera.inverse().transform(rays[seen]))
    assert ((inside > -0.5) & (inside < np.array(ideal.camera.size_px) - 0.5)).all()
    assert max(ideal.camera.size_px) <= 2 * max(SIZE_PX)


def test_a_pinhole_passes_pictures_as_they_are() -> None:
    flat = {"size_px": SIZE_PX, "focal_px": FOCAL_PX, "center_px": CENTER_PX}
    for lens in (Lens(model="pinhole", **flat), brown((0.0,) * 5)):
        ideal = undistortion(lens, np.array([[3.0, 4.0]]))
        image, depth = textured(SIZE_PX), np.ones(SIZE_PX[::-1], np.float32)
        assert ideal.map_px is None
        assert ideal.image(image) is image
        assert ideal.depth(depth) is depth
        assert ideal.mask(np.ones(SIZE_PX[::-1], np.uint8)).min() == 255
        assert ideal.camera.center_px == CENTER_PX


def test_the_same_lens_gives_the_same_maps() -> None:
    one, two = (undistortion(wide_fisheye(), np.array([[700.0, 400], [800, 500]])) for _ in "ab")
    assert one.map_px is not None
    assert two.map_px is not None
    assert one.map_px.tobytes() == two.map_px.tobytes()


# What is refused.


@pytest.mark.parametrize(
    ("model", "coefficients", "words"),
    [
        ("fov", (), "known models: pinhole, brown_conrady, kannala_brandt"),
        ("pinhole", (0.1,), "1 was given"),
        ("brown_conrady", (0.1, 0.2), "4, 5 or 8"),
        ("kannala_brandt", (0.1,) * 5, "takes 4"),
        ("kannala_brandt", (0.1, 0.0, float("nan"), 0.0), "index 2 is NaN"),
        ("brown_conrady", (0.1, float("inf"), 0.0, 0.0), "index 1 is inf"),
    ],
)
def test_an_impossible_lens_is_refused(
    model: str, coefficients: tuple[float, ...], words: str
) -> None:
    flat = {"size_px": SIZE_PX, "focal_px": FOCAL_PX, "center_px": CENTER_PX}
    with pytest.raises(CameraError, match=words):
        Lens(model=model, distortion=coefficients, **flat)


def test_an_object_that_no_pinhole_can_hold_is_refused_with_the_limit() -> None:
    lens = wide_fisheye()
    with pytest.raises(CameraError, match="at most 120 degrees"):
        undistortion(lens, np.array([[100.0, 450], [450, 100], [800, 450], [450, 800]]))
    with pytest.raises(CameraError, match="sees none of the object's 2 pixels"):
        undistortion(lens, np.array([[-4000.0, 0], [np.nan, 3]]))
    with pytest.raises(CameraError, match="sees none of the object's 0 pixels"):
        undistortion(lens, np.zeros((0, 2)))
    with pytest.raises(CameraError, match="nothing inside its image"):
        undistortion(brown((-0.3, 0.0, 0.0, 0.0), center_px=(9000.0, 0.0)))


def test_pictures_of_another_size_are_refused() -> None:
    ideal = undistortion(brown(BROWN[0]))
    with pytest.raises(ImageError, match="the image is 8x6 pixels, but the lens has 640x480"):
        ideal.image(np.zeros((6, 8, 3), np.uint8))
    with pytest.raises(MaskError, match="8x6"):
        ideal.mask(np.zeros((6, 8), np.uint8))
    with pytest.raises(MaskError, match="shape"):
        ideal.mask(np.zeros((480, 640, 3), np.uint8))
    with pytest.raises(ImageError, match="8x6"):
        ideal.depth(np.zeros((6, 8), np.float32))


def test_an_ideal_camera_elsewhere_than_its_lens_is_refused() -> None:
    lens = brown(BROWN[0])
    camera = Camera(size_px=(8, 6), focal_px=(9.0, 9.0), center_px=(4.0, 3.0))
    with pytest.raises(CameraError, match="give a rotation"):
        lens.map_to(camera, Pose.from_parts([0.0, 0.1, 0.0], [1.0, 0.0, 0.0, 0.0]))

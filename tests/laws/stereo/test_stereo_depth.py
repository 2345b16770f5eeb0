from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.camera import Camera
from servoid.capture import open_capture
from servoid.errors import CameraError, ImageError, TargetError
from servoid.pose import Pose
from servoid.stereo import StereoDepth, rough_depth, stereo_depth

SIZE_PX = (240, 180)
CAMERA = Camera(size_px=SIZE_PX, focal_px=(300.0, 303.0), center_px=(118.0, 91.0))
OTHER = Camera(size_px=SIZE_PX, focal_px=(296.0, 295.0), center_px=(121.0, 88.0))
BALL, RADIUS, WALL = np.array([0.005, -0.004, 0.5]), 0.08, 0.75
RIGS = {
    "b right of a": ((0.06, 0.0, 0.0), (0, 0, 0)),
    "b left of a": ((-0.06, 0.0, 0.0), (0, 0, 0)),
    "b above a": ((0.0, -0.06, 0.0), (0, 0, 0)),
    "b below a": ((0.0, 0.06, 0.0), (0, 0, 0)),
    "toed in": ((0.07, 0.0, 0.0), (0, -8, 0)),
    "toed in, left, rolled": ((-0.07, 0.01, 0.01), (3, 7, 5)),
}


def rig(name: str) -> Pose:
    matrix = np.eye(4)
    matrix[:3, 3], turn_deg = RIGS[name]
    matrix[:3, :3] = Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix()
    return Pose(matrix)


def draw(camera: Camera, a_from_camera: Pose) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Draw a ball before a wall, both with a pattern in space; also return z in the frame of a."""
    columns, rows = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    slopes = [
        (pixel - center) / focal
        for pixel, center, focal in zip(
            (columns, rows), camera.center_px, camera.focal_px, strict=True
        )
    ]
    rays = np.stack([*slopes, np.ones(columns.shape)], axis=-1)
    matrix = a_from_camera.matrix()
    rays, origin = rays @ matrix[:3, :3].T, matrix[:3, 3]
    far = (WALL - origin[2]) / rays[..., 2]
    a, b = (rays * rays).sum(axis=-1), rays @ (origin - BALL)
    root = b * b - a * ((origin - BALL) @ (origin - BALL) - RADIUS**2)
    near = np.where(root > 0.0, (-b - np.sqrt(np.maximum(root, 0.0))) / a, far)
    points = origin + near[..., None] * rays
    random = np.random.default_rng(5)
    ways, phases = random.normal(size=(40, 3)), random.uniform(0.0, 2.0 * np.pi, 40)
    ways *= 2.0 * np.pi / (random.uniform(0.008, 0.05, 40) * np.linalg.norm(ways, axis=1))[:, None]
    pattern = 128.0 + 14.0 * np.sin(points @ ways.T + phases).sum(axis=-1)
    noise = random.normal(scale=1.5, size=pattern.shape)
    image = np.clip(np.rint(pattern + noise), 0, 255).astype(np.uint8)
    return np.repeat(image[..., None], 3, axis=2), points[..., 2]


def measure(name: str, *, masked: bool) -> tuple[StereoDepth, NDArray[np.float64]]:
    image_a, truth = draw(CAMERA, Pose.identity())
    image_b, _ = draw(OTHER, rig(name))
    mask = (truth < WALL - 0.01).astype(np.uint8) if masked else None
    return stereo_depth(image_a, image_b, CAMERA, OTHER, rig(name), mask_a=mask), truth


@pytest.mark.parametrize("name", RIGS)
def test_a_ball_is_measured_to_a_millimetre_whatever_the_rig(name: str) -> None:
    found, truth = measure(name, masked=True)
    on_ball = truth < WALL - 0.01
    known = np.isfinite(found.depth)
    errors = np.abs(found.depth - truth)[known]
    assert not known[~on_ball].any()
    assert known[on_ball].mean() > 0.8
    assert np.median(errors) < 0.001
    assert np.quantile(errors, 0.9) < 0.004


@pytest.mark.parametrize("name", ["b right of a", "toed in, left, rolled"])
def test_without_a_mask_ball_and_wall_are_measured(name: str) -> None:
    found, truth = measure(name, masked=False)
    known = np.isfinite(found.depth)
    errors = np.abs(found.depth - truth)
    assert known.mean() > 0.5
    assert np.median(errors[known & (truth < WALL - 0.01)]) < 0.0015
    assert np.median(errors[known & (truth > WALL - 0.01)]) < 0.003


@pytest.mark.parametrize("name", RIGS)
def test_rough_depth_tells_the_ball_from_the_wall_whatever_the_rig(name: str) -> None:
    image_a, truth = draw(CAMERA, Pose.identity())
    image_b, _ = draw(OTHER, rig(name))
    asked = np.zeros(truth.shape, np.uint8)
    asked[20:160, 20:220] = 255
    found = rough_depth(image_a, image_b, CAMERA, OTHER, rig(name), mask_a=asked)
    known = np.isfinite(found)
    assert not known[asked == 0].any()
    assert known[asked != 0].mean() > 0.6
    between = 0.5 * (WALL + BALL[2])
    assert ((found < between) == (truth < between))[known].mean() > 0.97
    assert np.quantile(np.abs(found / truth - 1.0)[known], 0.9) < 0.04


def test_the_expected_error_holds_two_thirds_and_grows_with_depth() -> None:
    found, truth = measure("b right of a", masked=False)
    known = np.isfinite(found.depth)
    assert (np.abs(found.depth - truth)[known] < found.sigma_m[known]).mean() > 0.6
    near, far = (known & (truth < 0.5)), (known & (truth > WALL - 0.01))
    assert np.median(found.sigma_m[far]) > 1.5 * np.median(found.sigma_m[near])
    assert (np.isfinite(found.sigma_m) == known).all()


def test_the_same_pair_gives_the_same_bits_on_any_thread_count() -> None:
    import cv2

    threads = cv2.getNumThreads()
    depths = []
    try:
        for count in (1, 4):
            cv2.setNumThreads(count)
            depths.append(measure("toed in", masked=True)[0].depth.tobytes())
    finally:
        cv2.setNumThreads(threads)
    assert depths[0] == depths[1]


def test_a_pair_from_one_place_is_refused() -> None:
    image, _ = draw(CAMERA, Pose.identity())
    with pytest.raises(CameraError, match="same position"):
        stereo_depth(image, image, CAMERA, CAMERA, Pose.identity())


def test_cameras_one_behind_the_other_are_refused() -> None:
    image, _ = draw(CAMERA, Pose.identity())
    with pytest.raises(CameraError, match="line of sight"):
        stereo_depth(image, image, CAMERA, CAMERA, Pose.exp([0.01, 0.0, 0.1, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize(("turn", "error"), [(3.0, CameraError), (1.2, TargetError)])
def test_cameras_without_a_common_field_are_refused(
    turn: float, error: type[CameraError] | type[TargetError]
) -> None:
    image, _ = draw(CAMERA, Pose.identity())
    with pytest.raises(error, match=r"apart|does not see"):
        stereo_depth(image, image, CAMERA, CAMERA, Pose.exp([0.1, 0.0, 0.0, 0.0, turn, 0.0]))


def test_images_without_texture_are_refused_in_words() -> None:
    image = np.full((SIZE_PX[1], SIZE_PX[0], 3), 90, np.uint8)
    with pytest.raises(TargetError, match="texture"):
        stereo_depth(image, image, CAMERA, CAMERA, rig("b right of a"))


def test_an_image_of_another_size_is_refused() -> None:
    image, _ = draw(CAMERA, Pose.identity())
    with pytest.raises(ImageError, match=r"image b has the shape \(90, 240, 3\)"):
        stereo_depth(image, image[:90], CAMERA, CAMERA, rig("b right of a"))


def test_an_empty_mask_is_refused() -> None:
    image, _ = draw(CAMERA, Pose.identity())
    mask = np.zeros(image.shape[:2], np.uint8)
    with pytest.raises(TargetError, match="0 pixels"):
        stereo_depth(image, image, CAMERA, CAMERA, rig("b right of a"), mask_a=mask)


@pytest.mark.parametrize("place", [(0, 0), (90, 120), (179, 239), (90, 1)])
@pytest.mark.parametrize("side", [1, 12])
def test_a_tiny_mask_anywhere_gives_its_depth_or_an_error_in_words(
    place: tuple[int, int], side: int
) -> None:
    image_a, truth = draw(CAMERA, Pose.identity())
    image_b, _ = draw(OTHER, rig("toed in"))
    mask = np.zeros(truth.shape, np.uint8)
    mask[place[0] : place[0] + side, place[1] : place[1] + side] = 255
    try:
        found = stereo_depth(image_a, image_b, CAMERA, OTHER, rig("toed in"), mask_a=mask)
    except TargetError as refused:
        assert "second camera" in str(refused)
        return
    known = np.isfinite(found.depth)
    assert not known[mask == 0].any()
    if known.sum() > 8:
        assert np.median(np.abs(found.depth - truth)[known]) < 0.01


@pytest.mark.parametrize(("name", "median_m"), [("mustard", 0.0008), ("drill", 0.0011)])
def test_rendered_objects_are_measured_to_a_millimetre(
    name: str, median_m: float, photos: Callable[[str], Path]
) -> None:
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("embreex")
    folder = photos("skull").parents[1] / "stereo" / name
    if not folder.is_dir():
        pytest.skip(f"the stereo set {name} lies beside the repository, and not here")
    capture = open_capture(folder)
    view = capture.views()[0]
    other = next(o for o in capture.all_views() if o.index == view.index and o.name != view.name)
    row = np.loadtxt(folder / "truth" / "left_from_object.csv", delimiter=",", skiprows=1)[0]
    mesh = trimesh.load(folder / "truth" / "mesh.obj", process=False, force="mesh")
    mesh.apply_transform(Pose.from_parts(row[1:4], row[4:8]).matrix())
    rows, columns = np.nonzero(view.mask())
    camera = view.camera
    slopes = (np.column_stack([columns, rows]) - camera.center_px) / camera.focal_px
    rays = np.column_stack([slopes, np.ones(len(slopes))])
    hits, index, _ = mesh.ray.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    found = stereo_depth(
        view.image(),
        other.image(),
        camera,
        other.camera,
        view.world_from_camera.inverse() @ other.world_from_camera,
        mask_a=view.mask(),
    )
    errors = np.abs(found.depth[rows[index], columns[index]] - hits[:, 2])
    known = np.isfinite(errors)
    assert known.mean() > 0.9
    assert np.median(errors[known]) < median_m

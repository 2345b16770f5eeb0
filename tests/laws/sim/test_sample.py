"""The sample capture: where things are is computed again here, from its files alone."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.capture import open_capture
from servoid.errors import OutputError
from servoid.sim import write_sample
from servoid.sim.samples import bird, sample, studio
from servoid.sim.samples.drawing.solids import RoundBox, RoundCone, RoundCylinder

VIEWS = 5
SIZE_PX = (240, 180)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sample(tmp_path_factory.mktemp("made") / "bird", views=VIEWS, size_px=SIZE_PX)


@pytest.fixture(scope="module")
def surface() -> NDArray[np.float64]:
    """Points on the bird, by Newton's steps from random places rather than along rays."""
    random = np.random.default_rng(3)
    spread = random.uniform(-1.0, 1.0, (3, 400_000)) * 0.15 + [[-0.01], [0.01], [0.10]]
    points = spread.astype(np.float32)
    points = points[:, np.abs(bird.distance(points)) < 0.03]
    for _ in range(6):
        gradient = np.stack(
            [bird.distance(points + step) - bird.distance(points - step) for step in _steps(5e-4)]
        ) / np.float32(1e-3)
        points = points - gradient * bird.distance(points) / (gradient**2).sum(axis=0)
    points = points[:, np.abs(bird.distance(points)) < 2e-5]
    assert points.shape[1] > 60_000
    return points.astype(np.float64)


def _steps(size: float) -> NDArray[np.float32]:
    return np.eye(3, dtype=np.float32)[:, :, None] * np.float32(size)


def poses_of(folder: Path) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    rows = np.loadtxt(folder / "poses.csv", delimiter=",", skiprows=1)
    return [(Rotation.from_quat(row[[5, 6, 7, 4]]).as_matrix(), row[1:4]) for row in rows]


def pixels_of(
    folder: Path, index: int, points_in_world: NDArray[np.float64]
) -> NDArray[np.float64]:
    text = (folder / "capture.toml").read_text()
    (focal_u, focal_v), (center_u, center_v) = (
        map(float, re.findall(rf"^{key} = \[(.*), (.*)\]$", text, re.MULTILINE)[0])
        for key in ("focal_px", "center_px")
    )
    turn, place = poses_of(folder)[index]
    x, y, z = turn.T @ (points_in_world - place[:, None])
    assert (z > 0).all()
    return np.stack([focal_u * x / z + center_u, focal_v * y / z + center_v])


def mask_of(folder: Path, index: int) -> NDArray[np.uint8]:
    mask = cv2.imread(str(folder / "masks" / f"{index:04d}.png"), cv2.IMREAD_GRAYSCALE)
    assert mask is not None
    return np.asarray(mask, np.uint8)


@pytest.mark.parametrize("index", range(VIEWS))
def test_points_of_the_surface_fall_into_the_mask(
    written: Path, surface: NDArray[np.float64], index: int
) -> None:
    grown = cv2.dilate(mask_of(written, index), np.ones((3, 3), np.uint8))
    u, v = np.rint(pixels_of(written, index, surface)).astype(int)
    assert (grown[v, u] == 255).all()


@pytest.mark.parametrize("index", range(VIEWS))
def test_the_mask_is_what_the_surface_covers(
    written: Path, surface: NDArray[np.float64], index: int
) -> None:
    mask = mask_of(written, index)
    # On a grid four times as fine, whose every fourth point is a pixel's centre.
    u, v = np.rint(4 * pixels_of(written, index, surface)).astype(int)
    fine = np.zeros((4 * mask.shape[0], 4 * mask.shape[1]), np.uint8)
    fine[v, u] = 255
    covered = cv2.morphologyEx(fine, cv2.MORPH_CLOSE, np.ones((7, 7), np.uint8))[::4, ::4]
    both = np.count_nonzero((covered > 0) & (mask > 0))
    assert both / np.count_nonzero((covered > 0) | (mask > 0)) > 0.98
    # Half a pixel of offset would show as a lean of the difference to one side.
    rows, columns = np.nonzero(mask)
    covered_rows, covered_columns = np.nonzero(covered)
    assert columns.mean() == pytest.approx(covered_columns.mean(), abs=0.15)
    assert rows.mean() == pytest.approx(covered_rows.mean(), abs=0.15)


def test_the_bird_is_whole_in_every_view_and_fills_a_fair_part(written: Path) -> None:
    for index in range(VIEWS):
        mask = mask_of(written, index)
        assert set(np.unique(mask)) == {0, 255}
        border = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
        assert not border.any()
        assert 0.05 < np.count_nonzero(mask) / mask.size < 0.5


def test_no_ray_slips_through_where_it_grazes_a_part() -> None:
    shot = studio.plan_shots(16, (480, 360))[4]  # one wing is seen edge-on before the body
    mask = studio.photograph(shot, seed=0)[1]
    count, _, found, _ = cv2.connectedComponentsWithStats(255 - mask, connectivity=4)
    assert [area for area in found[1:count, cv2.CC_STAT_AREA] if area < 20] == []


def test_poses_are_rigid_and_cameras_stand_upright_and_look_at_the_bird(written: Path) -> None:
    for turn, place in poses_of(written):
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0)
        assert turn[2, 1] < 0  # the camera's y is down
        toward = np.array([-0.01, 0.01, 0.09]) - place
        assert turn[:, 2] @ toward / np.linalg.norm(toward) > 0.99


def test_no_mask_is_cut_by_the_ball_that_rays_are_tried_in(surface: NDArray[np.float64]) -> None:
    away = np.linalg.norm(surface - np.array(bird.BOUND_CENTER)[:, None], axis=0)
    assert away.max() < bird.BOUND_RADIUS


def test_the_bird_stands_on_the_table_and_is_about_two_hundred_millimetres_high(
    surface: NDArray[np.float64],
) -> None:
    assert surface[2].min() == pytest.approx(0.0, abs=1e-3)
    assert surface[2].max() == pytest.approx(0.2, abs=0.02)


def test_the_images_show_the_bird_in_its_paint(written: Path) -> None:
    view = open_capture(written).views()[0]
    hue = cv2.cvtColor(view.image(), cv2.COLOR_RGB2HSV)
    colorful = hue[:, :, 1] > 120
    inside = view.mask() > 0
    assert colorful[inside].mean() > 0.3
    assert colorful[~inside].mean() < 0.02


def test_the_same_arguments_give_the_same_bytes(written: Path, tmp_path: Path) -> None:
    again = write_sample(tmp_path / "again", views=VIEWS, size_px=SIZE_PX)
    first, second = (
        {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*.*")}
        for folder in (written, again)
    )
    assert len(first) == 2 + 2 * VIEWS
    assert first == second


def test_progress_counts_every_view(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    write_sample(
        tmp_path / "a", views=2, size_px=(40, 30), progress=lambda *call: calls.append(call)
    )
    assert calls == [(1, 2), (2, 2)]


def test_a_folder_that_holds_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "letters.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"such as letters\.txt, .* name a folder that is empty"):
        write_sample(tmp_path, views=1, size_px=(40, 30))
    assert [path.name for path in tmp_path.iterdir()] == ["letters.txt"]


def test_a_capture_of_someone_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "capture.toml").write_text("version = 1\n")
    with pytest.raises(OutputError, match="holds other files"):
        write_sample(tmp_path, views=1, size_px=(40, 30))
    assert (tmp_path / "capture.toml").read_text() == "version = 1\n"


def test_a_file_in_the_way_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="it is a file; name a folder"):
        write_sample(tmp_path / "file", views=1, size_px=(40, 30))


def test_an_earlier_sample_is_replaced(tmp_path: Path) -> None:
    for views in (2, 1):
        write_sample(tmp_path / "a", views=views, size_px=(40, 30))
    assert [path.name for path in (tmp_path / "a" / "images").iterdir()] == ["0000.jpg"]
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize(
    "name", ["images/zz_mine.jpg", "images/0001.jpg", "masks/hand_made.png", "masks/a/b.txt", "my"]
)
def test_a_sample_to_which_a_file_was_added_is_refused_by_the_name_of_the_file(
    tmp_path: Path, name: str
) -> None:
    sample_folder = write_sample(tmp_path / "a", views=1, size_px=(40, 30))
    added = sample_folder / name
    added.parent.mkdir(exist_ok=True)
    added.write_bytes(b"mine")
    with pytest.raises(OutputError, match=f"other files, such as {name}, "):
        write_sample(sample_folder, views=1, size_px=(40, 30))
    assert added.read_bytes() == b"mine"


def test_a_sample_that_breaks_off_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sample, "_capture", full)
    with pytest.raises(OutputError, match="no space left"):
        write_sample(tmp_path / "a", views=1, size_px=(40, 30))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("views", "size_px"), [(0, (40, 30)), (1, (0, 30))])
def test_no_views_or_no_pixels_are_refused(
    tmp_path: Path, views: int, size_px: tuple[int, int]
) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        write_sample(tmp_path / "a", views=views, size_px=size_px)


coordinate = st.floats(-0.25, 0.25, width=32)
point = st.tuples(coordinate, coordinate, coordinate)


@given(point, point)
def test_a_distance_changes_no_faster_than_the_way(
    first: tuple[float, float, float], second: tuple[float, float, float]
) -> None:
    # Otherwise a step along a ray could jump through the surface.
    points = np.array([first, second], np.float32).T
    near, far = bird.distance(points)
    assert abs(near - far) <= 1.0001 * np.linalg.norm(np.subtract(first, second)) + 1e-6


@given(st.floats(0.0, 2 * np.pi), st.floats(-1.0, 1.0), st.floats(0.01, 0.05))
def test_a_point_lifted_off_a_drop_is_as_far_as_it_was_lifted(
    angle: float, share: float, lift: float
) -> None:
    drop = RoundCone((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.04, 0.01)
    lean = 0.3  # (0.04 - 0.01) / 0.1, the sine of the flank's slope
    along = 0.05 + 0.05 * share
    normal = np.array([lean, *(np.sqrt(1 - lean**2) * np.array([np.cos(angle), np.sin(angle)]))])
    lifted = np.array([along, 0.0, 0.0]) + normal * (0.04 - lean * along + lift)
    assert drop.distance(lifted[:, None].astype(np.float32))[0] == pytest.approx(lift, abs=1e-6)


def test_boxes_and_cylinders_know_their_faces() -> None:
    box = RoundBox((0.0, 0.0, 0.0), (0.03, 0.02, 0.01), 0.002, np.eye(3))
    can = RoundCylinder((0.0, 0.0, 0.0), 0.03, 0.01, 0.002)
    points = np.array([[0.05, 0, 0], [0, 0, 0.03], [0, 0, 0]], np.float32).T
    np.testing.assert_allclose(box.distance(points), [0.02, 0.02, -0.01], atol=1e-7)
    np.testing.assert_allclose(can.distance(points), [0.02, 0.02, -0.01], atol=1e-7)

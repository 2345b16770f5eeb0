"""Photographs are shrunk as they are read where together they would not fit into memory."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from conftest import CENTER_PX, FOCAL_PX, SIZE_PX, Drawing
from servoid.camera import Lens, read_image, read_mask
from servoid.camera.depth import read_depth
from servoid.camera.images import shrink
from servoid.capture import open_capture, shrinking, shrunk
from servoid.model import fit, fit_capture
from servoid.segment import BoxTarget
from servoid.shape import load_body

HERE = Path(__file__).parent
ONE_VIEW_PX = SIZE_PX[0] * SIZE_PX[1]
MOST_RESIDENT_MIB = 1100


@pytest.fixture
def little_room(monkeypatch: pytest.MonkeyPatch) -> int:
    """Leave room for half of what eight drawn views have."""
    monkeypatch.setattr(shrinking, "MOST_VIEW_PX", 4 * ONE_VIEW_PX)
    return 4 * ONE_VIEW_PX


def test_views_that_fit_stay_as_they_are(drawn_capture: Path) -> None:
    views = open_capture(drawn_capture).views()
    small, note = shrunk(views)
    assert (small, note) == (views, None)


def test_views_that_do_not_fit_are_shrunk_until_they_do(
    drawn_capture: Path, little_room: int
) -> None:
    views, note = shrunk(open_capture(drawn_capture).views())
    assert note is not None and "8 images of 160x120 pixels were shrunk to 80x60" in note
    assert sum(view.image().size // 3 for view in views) <= little_room
    for view in views:
        assert view.image().shape == (60, 80, 3)
        assert view.mask().shape == (60, 80)
    again, note = shrunk(views)
    assert (again, note) == (views, None)


@pytest.mark.parametrize("distortion", [(), (-0.2, 0.05, 0.001, -0.002)])
@pytest.mark.parametrize("by", [2, 4])
def test_a_small_lens_sees_a_point_where_the_shrunk_image_shows_it(
    distortion: tuple[float, ...], by: int
) -> None:
    lens = Lens(
        model="brown_conrady" if distortion else "pinhole",
        size_px=SIZE_PX,
        focal_px=(FOCAL_PX, FOCAL_PX),
        center_px=CENTER_PX,
        distortion=distortion,
    )
    points = np.array([[0.0, 0.0, 1.0], [0.2, -0.1, 0.9], [-0.15, 0.12, 0.7]])
    large = lens.project(points)
    small = shrinking._small(lens, by).project(points)
    assert small == pytest.approx((large + 0.5) / by - 0.5, abs=1e-9)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize("size", [(160, 120), (163, 121)])
@pytest.mark.parametrize("by", [2, 4, 16])
def test_an_image_that_is_shrunk_as_it_is_read_has_the_means_of_its_pixels(
    tmp_path: Path, suffix: str, size: tuple[int, int], by: int
) -> None:
    width, height = size
    noise = np.random.default_rng(0).normal(128.0, 40.0, (height, width, 3))
    soft = cv2.GaussianBlur(noise, (0, 0), 4.0)
    cv2.imwrite(str(tmp_path / f"a{suffix}"), soft.clip(0, 255).astype(np.uint8))
    whole = read_image(tmp_path / f"a{suffix}", size)
    small = read_image(tmp_path / f"a{suffix}", size, by)
    assert small.shape == (height // by, width // by, 3)
    assert np.abs(small.astype(int) - shrink(whole, by)).max() <= 6


def test_a_mask_that_is_shrunk_holds_what_is_at_least_half_the_objects(tmp_path: Path) -> None:
    mask = np.zeros((6, 9), np.uint8)
    mask[:2, :2], mask[2:4, 4:7], mask[4, 0] = 1, 1, 1
    cv2.imwrite(str(tmp_path / "m.png"), mask)
    small = read_mask(tmp_path / "m.png", (9, 6), 2)
    assert (small == np.array([[255, 0, 0, 0], [0, 0, 255, 255], [0, 0, 0, 0]])).all()


def test_depth_that_is_shrunk_is_measured_and_no_mean(tmp_path: Path) -> None:
    depth = np.where(np.arange(16) < 7, 0.5, 2.0) * np.ones((12, 1))
    np.save(tmp_path / "d.npy", depth.astype(np.float32))
    small = read_depth(tmp_path / "d.npy", (16, 12), 1.0, 4)
    assert small.shape == (3, 4)
    assert set(small.ravel().tolist()) == {0.5, 2.0}


@pytest.mark.extended
@pytest.mark.parametrize("targets", [[], [BoxTarget(40, 20, 120, 100)]])
def test_a_body_of_shrunk_views_is_about_where_that_of_whole_ones_is(
    drawn_capture: Path, monkeypatch: pytest.MonkeyPatch, targets: list[BoxTarget]
) -> None:
    capture = open_capture(drawn_capture)
    if targets:
        mask = capture.views()[0].mask()
        rows, columns = np.nonzero(mask)
        box = (columns.min(), rows.min(), columns.max(), rows.max())
        targets = [BoxTarget(*map(float, box))]
    bodies = []
    for most in (shrinking.MOST_VIEW_PX, 4 * ONE_VIEW_PX):
        monkeypatch.setattr(shrinking, "MOST_VIEW_PX", most)
        result = fit_capture(capture, targets=targets)
        assert any("were shrunk" in note for note in result.notes) == (most == 4 * ONE_VIEW_PX)
        bodies.append(result)
    whole, small = (result.body.world_from_object.translation for result in bodies)
    assert np.linalg.norm(np.subtract(whole, small)) < 3e-3
    assert bodies[1].iou_used.mean() > 0.9


@pytest.mark.usefixtures("little_room")
def test_fitting_views_shrinks_them_too_and_says_so(drawn_capture: Path) -> None:
    result = fit(open_capture(drawn_capture).views(), max_ellipsoids=2)
    assert any("were shrunk to 80x60" in note for note in result.notes)


def enlarge(capture: Path, size: tuple[int, int], copies: int) -> None:
    """Make a drawn capture one of large photographs, each image several times."""
    by = size[0] / SIZE_PX[0]
    toml = (capture / "capture.toml").read_text()
    toml = toml.replace("images/*.png", "images/*.jpg").replace("[160, 120]", f"{list(size)}")
    toml = toml.replace(f"[{FOCAL_PX}, {FOCAL_PX}]", f"[{by * FOCAL_PX}, {by * FOCAL_PX}]")
    centers = [(center + 0.5) * by - 0.5 for center in CENTER_PX]
    (capture / "capture.toml").write_text(toml.replace(f"{list(CENTER_PX)}", f"{centers}"))
    header, *poses = (capture / "poses.csv").read_text().splitlines()
    (capture / "poses.csv").write_text("\n".join([header, *copies * poses]) + "\n")
    for folder, suffix in (("images", ".jpg"), ("masks", ".png")):
        for number, path in enumerate(sorted((capture / folder).iterdir())):
            pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
            large = cv2.imencode(suffix, cv2.resize(pixels, size))[1].tobytes()
            path.unlink()
            for copy in range(copies):
                place = capture / folder / f"{copy * len(poses) + number:04}{suffix}"
                place.write_bytes(large)


@pytest.mark.extended
def test_a_hundred_photographs_of_12_megapixels_take_1100_mebibytes_at_most(
    tmp_path: Path, drawing: Drawing
) -> None:
    if not Path("/proc/self/status").exists():
        pytest.skip("this system does not say how large a process was")
    enlarge(drawing.write(tmp_path / "photos"), (4000, 3000), 13)
    arguments = ["model", str(tmp_path / "photos"), "--out", str(tmp_path / "body.json")]
    code = (
        "import sys\n"
        "from servoid.cli import main\n"
        "try:\n"
        "    main(sys.argv[1:])\n"
        "finally:\n"
        # Not `ru_maxrss`: that begins with the memory of the process that started this one.
        "    (most,) = [line for line in open('/proc/self/status') if 'VmHWM' in line]\n"
        "    print('KIB', most.split()[1])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code, *arguments, "--max-ellipsoids", "3"],
        capture_output=True,
        text=True,
        cwd=HERE,
    )
    assert ran.returncode == 0, ran.stderr
    assert "104 images of 4000x3000 pixels were shrunk to 1000x750" in ran.stdout
    assert int(ran.stdout.rpartition("KIB")[2]) < MOST_RESIDENT_MIB << 10
    assert len(load_body(tmp_path / "body.json").ellipsoids) <= 3

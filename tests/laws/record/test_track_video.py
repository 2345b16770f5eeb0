import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_tracker import FakeEstimate, FakeTracker, plain_body
from numpy.typing import NDArray

from servoid.camera import Camera
from servoid.camera.video import count_video_images
from servoid.errors import OutputError
from servoid.pose import Pose
from servoid.record import Overlay, check_video, image_video, overlay_video
from servoid.record import overlay as overlay_module
from servoid.record.outline import draw_outline, draw_points, project
from servoid.record.overlay import STATUS_COLORS
from servoid.source import Instant
from servoid.track import Followed, Tracked, TrackStep

AHEAD = Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
BEHIND = Pose.from_parts((0.0, 0.0, -0.5), (1.0, 0.0, 0.0, 0.0))
CAMERA = Camera(size_px=(201, 151), focal_px=(250.0, 250.0), center_px=(100.0, 75.0))
SIGHT = (CAMERA, Pose.identity())
GRAY = np.full((151, 201, 3), 120, np.uint8)
GREEN = STATUS_COLORS["tracking"]


def step_of(
    images: list[NDArray[np.uint8] | None],
    status: str = "tracking",
    confidence: float = 1.0,
    pose: Pose = AHEAD,
) -> TrackStep:
    class Fake(FakeTracker):
        made: list[FakeTracker] = []  # noqa: RUF012

    body = plain_body(pose, count=2)
    estimate = FakeEstimate(1.25, pose, status, confidence)
    tracked = Tracked(0, estimate, 0.001)  # type: ignore
    one = Followed("object", Fake([], body), body, None, (), tracked, 0.0)  # type: ignore
    instant = Instant(0, 1.25, (Pose.identity(),) * len(images), tuple(images))
    return TrackStep(instant, (one,), (tracked,), 1.0)


def overlay(cameras: int) -> Overlay:
    return Overlay([CAMERA] * cameras, ["left", "right"][:cameras], objects=1)


def test_what_is_drawn_strongly_lies_on_the_edge_of_the_silhouette() -> None:
    body = plain_body(AHEAD, count=2)
    camera = Camera(size_px=(601, 451), focal_px=(750.0, 750.0), center_px=(300.0, 225.0))
    image = np.full((451, 601, 3), 120, np.uint8)
    draw_outline(image, body, (camera, Pose.identity()), GREEN)
    inside = body.silhouette(camera, Pose.identity())
    from_edge = np.where(
        inside > 0,
        cv2.distanceTransform(inside, cv2.DIST_L2, 5),
        cv2.distanceTransform(255 - inside, cv2.DIST_L2, 5),
    )
    on_line = np.abs(image.astype(int) - GREEN).max(axis=2) < 12
    assert on_line.sum() > 400
    assert from_edge[on_line].max() < 3.0
    edge = cv2.morphologyEx(inside, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 0
    near_line = cv2.dilate(on_line.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert near_line[edge].all()


def test_only_surface_points_that_face_the_camera_are_drawn() -> None:
    points = np.array([[-0.02, 0.0, 0.0], [0.02, 0.0, 0.0]])
    normals = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    image = GRAY.copy()
    draw_points(image, (points, normals), AHEAD, SIGHT)
    rows, columns = np.nonzero((image != GRAY).any(axis=2))
    assert abs(rows.mean() - 75.0) < 0.6 and abs(columns.mean() - 90.0) < 0.6


def test_points_behind_the_camera_have_no_pixel() -> None:
    pixels = project(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]), SIGHT)
    assert pixels[0] == pytest.approx([100.0, 75.0])
    assert np.isnan(pixels[1]).all()


@pytest.mark.parametrize("pose", [AHEAD, BEHIND, Pose.identity()])
@pytest.mark.parametrize("image", [GRAY, GRAY[..., 0], None, GRAY[:40]], ids=str)
@pytest.mark.parametrize("status", STATUS_COLORS)
def test_any_step_can_be_drawn_and_no_image_is_changed(
    pose: Pose, image: NDArray[np.uint8] | None, status: str
) -> None:
    before = None if image is None else image.copy()
    page = overlay(2).draw(step_of([image, GRAY], status, np.nan, pose))
    assert page.shape == (*overlay(2).size_px[::-1], 3) and page.dtype == np.uint8
    assert before is None or np.array_equal(before, image)


@pytest.mark.parametrize("status", STATUS_COLORS)
@pytest.mark.parametrize("confidence", [0.0, 0.25, 1.0])
def test_the_bar_is_as_long_as_the_confidence_and_has_the_colour_of_the_status(
    status: str, confidence: float
) -> None:
    page = overlay(1).draw(step_of([GRAY], status, confidence))
    row = page[151 + 14, 8:128]
    filled = (row == STATUS_COLORS[status]).all(axis=1)
    assert filled.sum() == round(120 * confidence)
    assert filled[: filled.sum()].all()


def test_a_page_has_an_even_size_and_is_never_too_wide() -> None:
    wide = Camera(size_px=(3001, 1001), focal_px=(900.0, 900.0), center_px=(1500.0, 500.0))
    for made in (overlay(1), overlay(2), Overlay([wide, wide], ["a", "b"], 3)):
        width, height = made.size_px
        assert width % 2 == 0 and height % 2 == 0
        assert width <= 1922


def test_a_video_that_fails_leaves_the_old_one_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), overlay_video(path, overlay(1), 30.0) as add:
        add(step_of([GRAY]))
        raise ZeroDivisionError
    assert [one.name for one in tmp_path.iterdir()] == ["a.mp4"]
    assert path.read_text() == "old"


def test_a_video_shows_what_was_drawn(tmp_path: Path) -> None:
    step = step_of([GRAY])
    with overlay_video(tmp_path / "a.mp4", overlay(1), 29.97) as add:
        for _ in range(4):
            add(step)
    video = cv2.VideoCapture(str(tmp_path / "a.mp4"))
    found, image = video.read()
    drawn = overlay(1).draw(step)[..., ::-1].astype(int)
    assert found and np.abs(image - drawn).mean() < 4.0
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(29.97, abs=0.01)


@pytest.mark.parametrize("name", ["a.avi", "a", "none/a.mp4"])
def test_a_video_that_cannot_be_written_is_told_so(tmp_path: Path, name: str) -> None:
    with pytest.raises(OutputError, match="cannot write"):
        check_video(tmp_path / name)


@contextmanager
def files_no_larger_than(size: int) -> Iterator[None]:
    """Let each write beyond so many bytes of a file fail, as on a disk that is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("room", [100, 1 << 14, 1 << 16, 1 << 17])
def test_a_video_that_does_not_fit_is_an_error_and_leaves_nothing(
    tmp_path: Path, room: int
) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (40, 120, 160, 3), np.uint8)

    def write(path: Path) -> int:
        with image_video(path, (160, 120), 30.0) as add:
            for image in noise:
                add(image)
        return path.stat().st_size

    assert write(tmp_path / "whole.mp4") > 1 << 18
    (tmp_path / "whole.mp4").unlink()
    with (
        files_no_larger_than(room),
        pytest.raises(OutputError, match=r"small\.mp4: the encoder .*; is the disk full\?"),
    ):
        write(tmp_path / "small.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("count", [1, 2, 13, 50])
def test_a_video_has_as_many_images_as_were_added(tmp_path: Path, count: int) -> None:
    with image_video(tmp_path / "v.mp4", (64, 48), 25.0) as add:
        for index in range(count):
            add(np.full((48, 64, 3), 5 * index, np.uint8))
    assert count_video_images(tmp_path / "v.mp4") == count


@pytest.mark.parametrize(
    ("located", "size_px", "words"),
    [
        (True, (640, 480), "searching, located  confidence 100 %"),
        (False, (640, 480), "searching  confidence 100 %"),
        (True, (201, 151), "searching, located  100 %"),
    ],
)
def test_the_row_says_the_state_as_the_page_does_before_the_confidence(
    located: bool, size_px: tuple[int, int], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FakeEstimate, "located", located)
    written: list[str] = []
    monkeypatch.setattr(overlay_module, "write", lambda *given, **_: written.append(given[2]) or 0)
    width, height = size_px
    camera = Camera(size_px=size_px, focal_px=(250.0, 250.0), center_px=(width / 2, height / 2))
    image = np.zeros((height, width, 3), np.uint8)
    Overlay([camera], ["left"], objects=1).draw(step_of([image], "searching"))
    assert words in written

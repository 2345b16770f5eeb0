"""The report: what its pictures show is measured in their pixels."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from conftest import Drawing
from servoid.capture import open_capture
from servoid.cli.model.summary import print_summary
from servoid.errors import OutputError
from servoid.model import ModelResult, fit
from servoid.view import write_report
from servoid.view.body_picture import mean_up, solids_in_world
from servoid.view.model import report
from servoid.view.model.contact_sheet import (
    MOST_VIEWS,
    choose_views,
    draw_view,
    outline_colors,
    outline_points,
)
from servoid.view.model.curve import spread
from servoid.view.scores import scored_views
from servoid.view.solid_picture import Viewpoint, axes_toward, covered, render

PICTURES = ["body.png", "contact_sheet.png", "curve.png"]
NAMES = ["report.html", *PICTURES, "summary.json"]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> ModelResult:
    capture = Drawing().write(tmp_path_factory.mktemp("capture"))
    return fit(open_capture(capture).views(), max_ellipsoids=2, views=slice(None, None, 2))


def pixels(path: Path) -> NDArray[np.uint8]:
    image = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    assert image is not None
    return np.asarray(image, np.uint8)


@pytest.fixture(scope="module")
def written(result: ModelResult, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Write a report once, for all that only read it."""
    return write_report(result, tmp_path_factory.mktemp("written") / "report")


def test_a_report_is_a_page_three_pictures_and_a_summary_and_nothing_else(
    written: list[Path],
) -> None:
    folder = written[0].parent
    assert written == [folder / name for name in NAMES]
    assert sorted(path.name for path in folder.iterdir()) == sorted(NAMES)
    for name in PICTURES:
        picture = pixels(folder / name)
        assert min(picture.shape[:2]) > 400
        assert picture.std() > 10  # not blank


def test_the_same_result_gives_the_same_bytes_and_leaves_other_files_alone(
    result: ModelResult, written: list[Path], tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    again = write_report(result, tmp_path)
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in written]
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_the_summary_says_what_the_result_says(result: ModelResult, written: list[Path]) -> None:
    summary = json.loads(written[-1].read_text())
    assert summary["count"] == len(result.body)
    assert summary["fitness"] == result.fitness
    assert summary["seconds"] == result.seconds
    by_image = {row["image"]: (row["used"], row["iou"]) for row in summary["views"]}
    for views, ious, used in (
        (result.used_views, result.iou_used, True),
        (result.unused_views, result.iou_unused, False),
    ):
        for view, iou in zip(views, ious, strict=True):
            assert by_image.pop(view.image_path.name) == (used, iou)
    assert by_image == {}
    assert summary["iou_used"] == pytest.approx(np.mean(result.iou_used))
    assert [row["count"] for row in summary["steps"]] == [step.count for step in result.steps]


def test_page_and_terminal_begin_with_the_same_verdict(
    result: ModelResult, written: list[Path], capfd: pytest.CaptureFixture[str]
) -> None:
    page = written[0].read_text()
    first = re.findall(r'<p class="verdict">(.+)</p>', page)[0].lower()
    capfd.readouterr()
    print_summary("photos", result, Path("body.json"), ())
    head, _, rest = capfd.readouterr().out.partition("  ellipsoids ")
    assert head.splitlines()[1].startswith("  verdict ") and rest
    words = " ".join(head.split())
    assert first.startswith(words.removeprefix("Modelled photos verdict ").lower())


@pytest.mark.extended
def test_without_unused_views_the_summary_has_none_for_them(
    result: ModelResult, tmp_path: Path
) -> None:
    alone = replace(result, unused_views=(), iou_unused=np.empty(0), native_unused=())
    summary = json.loads(write_report(alone, tmp_path)[-1].read_text())
    assert summary["iou_unused"] is None
    assert {row["iou_unused"] for row in summary["steps"]} == {None}


def test_a_report_that_breaks_off_writes_nothing(
    result: ModelResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: ModelResult) -> bytes:
        raise OutputError("cannot encode")

    monkeypatch.setattr(report, "draw_body", broken)
    with pytest.raises(OutputError):
        write_report(result, tmp_path / "report")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_where_a_picture_belongs_is_refused_before_anything_is_written(
    result: ModelResult, tmp_path: Path
) -> None:
    (tmp_path / "body.png").mkdir()
    with pytest.raises(OutputError, match=r"body\.png: it is a folder"):
        write_report(result, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["body.png"]


def test_a_file_in_the_way_is_refused(result: ModelResult, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot write a report into"):
        write_report(result, tmp_path / "file")


@given(
    st.floats(0, np.pi),
    st.floats(1, 200),
    st.floats(1, 200),
    st.floats(-50, 50),
    st.integers(8, 99),
)
def test_outline_points_lie_on_the_ellipse(
    angle: float, first: float, second: float, shift: float, count: int
) -> None:
    axes = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    covariance = axes @ np.diag([first**2, second**2]) @ axes.T
    center = np.array([shift, 2.0])
    away = outline_points(center, covariance, count) - center
    levels = np.einsum("ni,ij,nj->n", away, np.linalg.inv(covariance), away)
    assert away.shape == (count, 2)
    np.testing.assert_allclose(levels, 1.0, rtol=1e-6)


def test_each_outline_is_drawn_in_its_own_colour(result: ModelResult) -> None:
    tile = draw_view(result.body, scored_views(result)[0], (400, 300)).astype(int)
    for color in outline_colors(len(result.body)):
        assert (np.abs(tile - color).max(axis=2) <= 2).sum() > 50


@given(st.integers(2, 12))
def test_outline_colours_can_be_told_apart(count: int) -> None:
    colors = np.array([outline_colors(count)], np.uint8)
    lab = cv2.cvtColor(colors.astype(np.float32) / 255, cv2.COLOR_RGB2Lab)[0]
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2) + 1e3 * np.eye(count)
    assert apart.min() > 15


@given(st.integers(1, 90), st.data())
def test_the_worst_view_is_always_shown(count: int, data: st.DataObject) -> None:
    views = [object() for _ in range(count)]
    worst = views[data.draw(st.integers(0, count - 1))]
    shown = choose_views(views, worst)  # type: ignore[arg-type]
    assert worst in shown
    assert len(set(map(id, shown))) == len(shown) == min(count, MOST_VIEWS)
    assert [view for view in views if view in shown] == shown


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=4), st.floats(0.01, 0.2))
def test_labels_keep_apart_and_in_order(places: list[float], gap: float) -> None:
    moved = spread(np.array(places), gap)
    order = np.argsort(places, kind="stable")
    assert (np.diff(moved[order]) >= gap - 1e-9).all()
    assert np.mean(moved) == pytest.approx(np.mean(places))


def test_labels_that_are_apart_stay_where_they_are() -> None:
    np.testing.assert_allclose(spread(np.array([0.9, 0.5, 0.7]), 0.1), [0.9, 0.5, 0.7])


@pytest.mark.parametrize("scale", [1.0, 1e-3, 2e6])
def test_a_picture_shows_the_ellipsoids_where_their_points_are_in_any_unit(
    result: ModelResult, scale: float
) -> None:
    found = solids_in_world(result.body, result.colors)
    solids = replace(found, centers=scale * found.centers, radii=scale * found.radii)
    toward = np.array([0.5, 0.7, -0.4]) / np.linalg.norm([0.5, 0.7, -0.4])
    axes = axes_toward(toward, np.array([0.0, 0.0, 1.0]))
    span = max(high - low for low, high in (solids.extent(axis) for axis in axes))
    seen = Viewpoint(axes, solids.centers.mean(axis=0), 1.3 * span / 80, (80, 72))
    random = np.random.default_rng(0).normal(size=(20_000, 3))
    sphere = random / np.linalg.norm(random, axis=1)[:, None]
    expected = np.zeros((72, 80), np.uint8)
    for center, turn, radii in zip(solids.centers, solids.turns, solids.radii, strict=True):
        u, v = np.rint(seen.project(center + (sphere * radii) @ turn.T)).astype(int).T
        expected[v, u] = 1
    shown = covered(solids, seen)
    assert shown.sum() > 300
    # A pixel may hold an edge and have its centre outside, and a gap narrower than one is filled.
    inner, outer = cv2.erode(expected, np.ones((3, 3))), cv2.dilate(expected, np.ones((3, 3)))
    assert shown[inner > 0].mean() > 0.99
    assert not shown[outer == 0].any()


def test_a_body_stands_on_light_paper_in_its_colours_and_throws_a_shadow(
    result: ModelResult,
) -> None:
    solids = solids_in_world(result.body, np.array([[200, 30, 30]] * len(result.body), np.uint8))
    up, toward = np.array([0.0, 0.0, 1.0]), np.array([0.8, 0.0, -0.6])
    axes = axes_toward(toward, up)
    span = max(high - low for low, high in (solids.extent(axis) for axis in axes))
    seen = Viewpoint(axes, solids.centers.mean(axis=0), 3.0 * span / 120, (120, 120))
    light = np.array([0.0, 0.6, 0.8])
    picture = render(solids, seen, up, light).astype(int)
    body = covered(solids, seen)
    inner = cv2.erode(body.astype(np.uint8), np.ones((3, 3))) > 0
    assert (picture[inner, 0] > 1.5 * picture[inner, 1]).mean() > 0.9
    away = cv2.dilate(body.astype(np.uint8), np.ones((3, 3))) == 0
    paper = picture[away]
    assert np.ptp(paper, axis=1).max() <= 1
    assert np.median(paper) == pytest.approx(246, abs=3)
    rows, columns = np.nonzero(away & (picture[:, :, 0] < 200))
    assert len(rows) > 50
    # The lamp is at +y, which is to the left of an eye that looks along +x.
    assert columns.mean() > np.nonzero(body)[1].mean()


def test_ellipsoids_in_the_world_have_the_outlines_that_the_core_draws(result: ModelResult) -> None:
    # An ellipsoid's widest points across a camera's ray fall inside the outline, its centre too.
    view = result.used_views[0]
    solids = solids_in_world(result.body, result.colors)
    camera_from_world = np.linalg.inv(view.world_from_camera.matrix())
    focal, middle = np.array(view.camera.focal_px), np.array(view.camera.center_px)
    outlines = result.body.outlines(view.camera, view.world_from_camera)
    random = np.random.default_rng(0).normal(size=(4000, 3))
    sphere = random / np.linalg.norm(random, axis=1)[:, None]
    for center, shape, outline in zip(solids.centers, solids.shapes, outlines, strict=True):
        assert outline is not None
        points = center + sphere @ np.linalg.cholesky(shape).T
        seen = points @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
        away = focal * seen[:, :2] / seen[:, 2:] + middle - outline[0]
        levels = np.einsum("ni,ij,nj->n", away, np.linalg.inv(outline[1]), away)
        assert levels.max() == pytest.approx(1.0, abs=0.01)


def test_up_is_what_the_cameras_call_up(result: ModelResult) -> None:
    up = mean_up(scored_views(result))
    agree = [-view.world_from_camera.matrix()[:3, 1] @ up for view in result.used_views]
    assert np.linalg.norm(up) == pytest.approx(1.0)
    assert np.mean(agree) > 0.1


@pytest.mark.extended
def test_a_real_capture_gets_a_report(photos: Callable[[str], Path], tmp_path: Path) -> None:
    views = open_capture(photos("temple")).views()
    write_report(fit(views, max_ellipsoids=3), tmp_path)
    assert pixels(tmp_path / "contact_sheet.png").shape[1] == 1640

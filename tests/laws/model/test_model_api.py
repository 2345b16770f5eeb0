import json
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes_model import drawn_figures, model_drawn

import servoid
from conftest import Drawing
from servoid.capture import CaptureView, open_capture
from servoid.errors import BodyError, CaptureError, ModelError
from servoid.model import (
    ModelResult,
    ModelSettings,
    Progress,
    Request,
    fit_capture,
    fit_capture_by_paper,
)


@pytest.fixture
def views(drawn_capture: Path) -> list[CaptureView]:
    return open_capture(drawn_capture).views()


@pytest.fixture
def result(views: list[CaptureView]) -> ModelResult:
    return servoid.model.fit(views, max_ellipsoids=3, delta=0.0, views=slice(0, None, 2))


def iou_of(result: ModelResult, view: CaptureView) -> float:
    seen = result.body.silhouette(view.camera, view.world_from_camera) != 0
    mask = view.mask() != 0
    return np.count_nonzero(seen & mask) / np.count_nonzero(seen | mask)


def test_a_capture_becomes_a_saved_body_in_three_lines(drawn_capture: Path, tmp_path: Path) -> None:
    capture = servoid.capture.open_capture(drawn_capture)
    result = servoid.model.fit(capture.views(), max_ellipsoids=2, delta=0.0)
    result.save(tmp_path / "body.json")
    saved = servoid.shape.load_body(tmp_path / "body.json")
    assert len(saved.ellipsoids) == 2
    assert saved.fitness == result.fitness
    np.testing.assert_array_equal(saved.colors(), result.colors)


def test_two_ellipsoids_are_found_where_they_were_drawn(
    views: list[CaptureView], drawing: Drawing
) -> None:
    result = servoid.model.fit(views, max_ellipsoids=2, delta=0.0)
    assert model_drawn.beyond(drawn_figures(result, drawing)) == []
    centers = result.body.world_from_object.transform(result.body.centers)
    for drawn in drawing.ellipsoids:
        nearest = np.linalg.norm(centers - drawn.center, axis=1).argmin()
        assert np.abs(result.colors[nearest].astype(int) - drawn.color).max() < 60


def test_the_slice_divides_the_views_into_used_and_unused(
    result: ModelResult, views: list[CaptureView]
) -> None:
    assert list(result.used_views) == views[::2]
    assert list(result.unused_views) == views[1::2]
    assert result.iou_used.shape == (4,)
    assert result.iou_unused.shape == (4,)


def test_a_slice_counts_as_in_python(views: list[CaptureView]) -> None:
    result = servoid.model.fit(views, max_ellipsoids=1, views=slice(-1, -4, -1))
    assert list(result.used_views) == views[-3:]
    assert len(result.unused_views) == 5


def test_without_unused_views_there_is_nothing_to_judge_by(views: list[CaptureView]) -> None:
    result = servoid.model.fit(views, max_ellipsoids=1)
    assert result.iou_unused.shape == (0,)
    assert np.isnan(result.iou_by_count.unused).all()


def test_the_ious_are_those_of_the_silhouettes(result: ModelResult) -> None:
    for view, iou in zip(result.used_views, result.iou_used, strict=True):
        assert iou == pytest.approx(iou_of(result, view), abs=1e-12)
    for view, iou in zip(result.unused_views, result.iou_unused, strict=True):
        assert iou == pytest.approx(iou_of(result, view), abs=1e-12)


def test_the_curve_ends_at_the_body_and_never_falls(result: ModelResult) -> None:
    curve = result.iou_by_count
    assert curve.counts.tolist() == [1, 2, 3]
    assert curve.used[-1] == pytest.approx(result.iou_used.mean())
    assert curve.unused[-1] == pytest.approx(result.iou_unused.mean())
    assert (np.diff(curve.used) >= 0).all()
    assert result.steps[-1].fitness == result.fitness


def test_settings_left_out_are_the_cores(views: list[CaptureView]) -> None:
    default = ModelSettings()
    given = servoid.model.fit(views, delta=default.delta).settings
    for name in ("max_ellipsoids", "delta", "seed", "held_out"):
        assert getattr(given, name) == getattr(default, name)


@pytest.mark.extended
def test_with_neither_count_nor_delta_held_out_views_choose_among_twelve(
    views: list[CaptureView],
) -> None:
    free = servoid.model.fit(views)
    # As many as were drawn, or one more.
    assert len(free.body) in (2, 3)
    settings = free.settings
    assert isinstance(settings, ModelSettings)
    assert (settings.held_out, settings.max_ellipsoids) == (True, 12)
    for one in ({"max_ellipsoids": 2}, {"delta": 0.01}):
        chosen = servoid.model.fit(views, **one).settings
        assert isinstance(chosen, ModelSettings)
        assert not chosen.held_out


def test_a_weight_out_of_range_is_refused_by_name_whatever_there_is_to_weigh(
    drawn_capture: Path,
) -> None:
    capture = open_capture(drawn_capture)
    for name in ("silhouette_weight", "volume_weight", "depth_weight"):
        request = Request(max_ellipsoids=1, **{name: -1.0})
        with pytest.raises(ModelError, match=f"{name} must be a number of at least 0"):
            fit_capture(capture, request)


def test_the_same_seed_gives_the_same_file_on_one_and_on_two_threads(
    views: list[CaptureView], tmp_path: Path
) -> None:
    for threads in (1, 2):
        result = servoid.model.fit(views, max_ellipsoids=3, delta=0.0, seed=7, threads=threads)
        result.save(tmp_path / f"{threads}.json")
    assert (tmp_path / "1.json").read_bytes() == (tmp_path / "2.json").read_bytes()


def test_the_file_says_how_the_body_was_made(result: ModelResult, tmp_path: Path) -> None:
    result.save(tmp_path / "body.json")
    assert json.loads((tmp_path / "body.json").read_text())["made_by"] == {
        "servoid": servoid.__version__,
        "seed": result.settings.seed,
        "max_ellipsoids": 3,
        "delta": 0.0,
        "views": ["eye/0000", "eye/0002", "eye/0004", "eye/0006"],
        "method": "region",
        "targets": [],
        "seen_points": 0,
    }


def test_progress_grows_to_the_end(views: list[CaptureView]) -> None:
    reports: list[Progress] = []
    result = servoid.model.fit(views, max_ellipsoids=3, delta=0.0, progress=reports.append)
    shares = [progress.share for progress in reports]
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < shares[-1] == pytest.approx(1.0)
    assert {1, 2, 3} <= {progress.count for progress in reports}
    assert reports[-1].fitness == pytest.approx(result.fitness)


def test_an_exception_in_the_progress_ends_the_modelling(views: list[CaptureView]) -> None:
    class EnoughError(Exception):
        pass

    def stop(progress: Progress) -> None:
        raise EnoughError(progress.count)

    with pytest.raises(EnoughError):
        servoid.model.fit(views, progress=stop)


def test_progress_is_told_on_the_callers_thread(views: list[CaptureView]) -> None:
    threads: set[int] = set()
    servoid.model.fit(
        views, max_ellipsoids=2, progress=lambda _: threads.add(threading.get_ident())
    )
    assert threads == {threading.get_ident()}


def test_ctrl_c_stops_the_core_long_before_it_would_end(views: list[CaptureView]) -> None:
    counts: list[int] = []

    def interrupt_soon(progress: Progress) -> None:
        counts.append(progress.count)
        if progress.count == 1:
            threading.Timer(0.02, os.kill, (os.getpid(), signal.SIGINT)).start()

    with pytest.raises(KeyboardInterrupt):
        servoid.model.fit(views, max_ellipsoids=60, delta=0.0, progress=interrupt_soon)
    assert max(counts) < 30


def test_other_threads_run_while_the_core_works(views: list[CaptureView]) -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.wait(0.0005):
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    servoid.model.fit(views, max_ellipsoids=3, delta=0.0)
    done.set()
    thread.join()
    assert ticks > 3


def test_no_selected_view_is_an_error_that_says_how_many_there_are(
    views: list[CaptureView],
) -> None:
    with pytest.raises(ModelError, match="views 8: selects none of the 8 views; choose among 0"):
        servoid.model.fit(views, views=slice(8, None, None))
    with pytest.raises(ModelError, match="no usable view: none was given, or none has a mask"):
        servoid.model.fit([])


@pytest.mark.parametrize(
    "settings", [{"max_ellipsoids": 0}, {"delta": float("nan")}, {"delta": -1}]
)
def test_settings_out_of_range_are_refused(
    settings: dict[str, float], views: list[CaptureView]
) -> None:
    with pytest.raises(ModelError, match=next(iter(settings))):
        servoid.model.fit(views, **settings)


@pytest.mark.parametrize("settings", [{"max_ellipsoids": -3}, {"delta": -1.0}, {"seed": -1}])
def test_settings_out_of_range_are_refused_before_any_image_is_read(
    settings: dict[str, Any], drawn_capture: Path
) -> None:
    capture = open_capture(drawn_capture)
    views = capture.views()
    for file in drawn_capture.rglob("*.png"):
        file.write_bytes(b"damaged")
    ways: list[Callable[[], ModelResult]] = [
        lambda: servoid.model.fit(views, **settings),
        lambda: fit_capture(capture, Request(**settings)),
        lambda: fit_capture_by_paper(capture, Request(**settings)),
    ]
    for fit in ways:
        with pytest.raises(ModelError, match=next(iter(settings))):
            fit()


def test_what_are_no_views_is_refused_in_words(drawn_capture: Path) -> None:
    capture = open_capture(drawn_capture)
    for wrong in (capture, iter(capture.views())):
        with pytest.raises(ModelError, match=r"servoid\.model\.fit_capture\(capture\), or by"):
            servoid.model.fit(wrong)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match=r"views must be a slice, .* but is 3"):
        servoid.model.fit(capture.views(), views=3)  # type: ignore[arg-type]
    with pytest.raises(CaptureError, match=r"a path must be a text or a pathlib.Path, but None"):
        open_capture(None)  # type: ignore[arg-type]
    with pytest.raises(BodyError, match=r"a path must be a text or a pathlib.Path, but 3 was"):
        servoid.shape.load_body(3)  # type: ignore[arg-type]

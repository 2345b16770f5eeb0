"""What pages tell of pictures to those who cannot see them, or see them on small screens."""

import re
from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from servoid.servo import ServoLog
from servoid.view.model import curve, html_page
from servoid.view.page_parts import fill, picture
from servoid.view.scores import ScoredView
from servoid.view.servo import servo_plots, servo_report
from servoid.view.track import track_report


@pytest.mark.parametrize("page", [html_page, servo_report, track_report])
def test_alternative_texts_say_what_is_drawn_and_do_not_repeat_the_heading(page: object) -> None:
    captions, shown = page._CAPTIONS, page._SHOWN  # pyright: ignore[reportAttributeAccessIssue]
    headings = {name: one if isinstance(one, str) else one[0] for name, one in captions.items()}
    assert set(shown) == set(headings)
    assert all(len(shown[name]) > 20 and shown[name] != headings[name] for name in shown)


def test_a_picture_can_be_scrolled_by_keys_on_a_small_screen() -> None:
    element = picture(b"", "A & B", "Lines of <a>")
    assert 'alt="Lines of &lt;a&gt;"' in element
    assert re.search(
        r'<div class="wide" role="region" tabindex="0" aria-label="A &amp; B"><img', element
    )


def test_all_plots_of_a_servo_run_say_from_when_their_time_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(servo_plots, "png", lambda figure: drawn.append(figure) or b"")
    names = [path.name for path in servo_plots.draw_servo_plots(ServoLog(("a", "b")), tmp_path)]
    assert names == ["hand.png", "joints.png", "gaze.png"]
    labels = [figure.axes[-1].get_xlabel() for figure in drawn]
    assert labels == ["time since servoing began, s"] * 3


@pytest.mark.parametrize("name", ["report.html", "track_report.html", "servo_report.html"])
def test_pages_keep_plots_readable_on_small_screens(name: str) -> None:
    text = fill(name, defaultdict(str)).decode()
    assert re.search(r"max-width: 640px\) \{\s+\.wide \{ overflow-x: auto; \}", text)


def test_each_table_of_views_can_be_scrolled_by_keys_on_a_small_screen() -> None:
    text = fill("report.html", defaultdict(str)).decode()
    assert re.search(r"\.scroll \{ overflow-x: auto;", text)
    view = SimpleNamespace(name="eye/1", image_path=Path("1.png"))
    table = html_page._table([ScoredView(view, True, 0.9)])  # type: ignore[arg-type]
    assert re.search(r'<div class="scroll" [^>]*tabindex="0" [^>]*><table>', table)


def test_a_curve_that_lies_on_another_is_seen_beside_it_and_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(curve, "png", lambda figure: figure)
    same, counts = np.array([0.7, 0.8, 0.9]), np.arange(1, 4)
    ious = SimpleNamespace(counts=counts, used=same, unused=np.full(3, np.nan))
    steps = [SimpleNamespace(fitness=value) for value in same]
    result = SimpleNamespace(iou_by_count=ious, steps=steps)
    [axes] = curve.draw_curve(result).axes  # type: ignore[arg-type, attr-defined]
    fitness, used = axes.get_lines()
    assert fitness.get_linewidth() >= 3.0 * used.get_linewidth()
    assert fitness.get_zorder() <= used.get_zorder()
    axes.figure.draw_without_rendering()
    upper, lower = sorted(
        (text.get_window_extent() for text in axes.texts), key=lambda box: -box.y0
    )
    assert upper.y0 >= lower.y1

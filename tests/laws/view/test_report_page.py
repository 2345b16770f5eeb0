"""The report's page: it needs nothing beside it, and says what the result says."""

import base64
import json
import re
import shutil
import subprocess
from collections import defaultdict
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

import servoid
from conftest import Drawing
from servoid.capture import open_capture
from servoid.model import ModelResult, RangeSamples, Request, fit, fit_mesh
from servoid.model.verdict import rate_body
from servoid.view import write_report
from servoid.view.model.html_page import _fitness_words, _rows
from servoid.view.page import INK, QUIET_INK
from servoid.view.page_parts import fill
from servoid.view.scores import UNUSED_COLOR, USED_COLOR, ScoredView, scored_views, verdict
from servoid.words import lengths

VOID = {"meta", "img", "link", "br"}


class Page(HTMLParser):
    """Collects what a browser would: elements, attributes, text, and whether all is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.content: dict[str, list[str]] = {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.content.setdefault(self.open[-1] if self.open else "", []).append(data)

    def attributes(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> ModelResult:
    capture = Drawing().write(tmp_path_factory.mktemp("capture"))
    for kind in ("images", "masks"):
        (capture / kind / "0001.png").rename(capture / kind / "0001 <b>&.png")
    return fit(open_capture(capture).views(), max_ellipsoids=2, views=slice(None, None, 2))


@pytest.fixture(scope="module")
def folder(result: ModelResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    write_report(
        result, folder, notes=["The side away from the cameras is <unknown>.", "{{script}}"]
    )
    return folder


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


def test_every_element_is_closed_and_nothing_comes_from_elsewhere(text: str) -> None:
    page = Page(text)
    assert page.open == []
    for tag, attributes in page.elements:
        for name in ("src", "href", "srcset", "action", "data"):
            value = attributes.get(name)
            assert value is None or value.startswith("data:"), (tag, value)
    assert re.findall(r"https?://|url\(|@import|\bimport\b|fetch\(|XMLHttp", text) == []
    (policy,) = [one for one in page.attributes("meta") if "http-equiv" in one]
    assert str(policy["content"]).startswith("default-src 'none';")


def test_the_page_says_what_it_is_of_and_which_version_made_it(
    result: ModelResult, tmp_path: Path
) -> None:
    write_report(result, tmp_path, source="out/<photos>")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"out/&lt;photos&gt; · servoid {servoid.__version__}</p>" in page


def test_the_page_holds_every_picture_of_the_report(folder: Path, text: str) -> None:
    shown = [str(image["src"]).split(",")[1] for image in Page(text).attributes("img")]
    written = [path.read_bytes() for path in sorted(folder.glob("*.png"))]
    assert sorted(base64.b64decode(one) for one in shown) == sorted(written)
    assert len(shown) == 3


def test_names_and_notes_are_text_whatever_they_hold(text: str) -> None:
    page = Page(text)
    assert page.attributes("b") == []
    assert "0001 <b>&.png" in "".join(page.content["td"])
    assert "".join(page.content["li"]) == "The side away from the cameras is <unknown>.{{script}}"


def test_placeholders_in_a_name_are_left_as_they_are(text: str) -> None:
    assert "<li>{{script}}</li>" in text


def test_without_notes_there_is_no_list(result: ModelResult, tmp_path: Path) -> None:
    write_report(result, tmp_path)
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page.attributes("ul") == []


def test_the_table_has_every_view_with_its_score(result: ModelResult, text: str) -> None:
    cells = re.findall(r'<td class="(used|unused)">\w+</td><td class="number">([\d.]+)', text)
    expected = [(one.use, f"{one.iou:.4f}") for one in scored_views(result)]
    assert cells == expected
    assert {use for use, _ in expected} == {"used", "unused"}
    worst = min(iou for _, iou in expected)
    assert re.findall(r'<tr class="worst">.*?([\d.]+)</td></tr>', text) == [worst]


def scene_of(text: str) -> dict[str, list[dict[str, list[float]]]]:
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', text, re.S)
    assert found
    return json.loads(found.group(1))


def ball_points() -> NDArray[np.float64]:
    points = np.random.default_rng(0).normal(size=(500, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def test_what_the_page_draws_is_the_body_scaled_and_moved(result: ModelResult, text: str) -> None:
    scene = scene_of(text)
    drawn = [np.array(one["center"]) for one in scene["ellipsoids"]]
    pose = result.body.world_from_object.matrix()
    centers = result.body.centers @ pose[:3, :3].T + pose[:3, 3]
    scale = np.linalg.norm(drawn[1] - drawn[0]) / np.linalg.norm(centers[1] - centers[0])
    shift = drawn[0] - scale * centers[0]
    np.testing.assert_allclose(drawn[1], scale * centers[1] + shift, atol=1e-5)
    for index, one in enumerate(scene["ellipsoids"]):
        w, x, y, z = result.body.rotations[index]
        # Turn points of the unit ball with the quaternion's own product.
        axis, points = np.array([x, y, z]), ball_points() * result.body.radii[index]
        twice = 2.0 * np.cross(axis, points)
        turned = points + w * twice + np.cross(axis, twice) + result.body.centers[index]
        world = turned @ pose[:3, :3].T + pose[:3, 3]
        ball = (scale * world + shift - one["center"]) @ np.array(one["to_ball"]).T
        np.testing.assert_allclose(np.linalg.norm(ball, axis=1), 1.0, atol=1e-5)
        assert one["color"] == result.colors[index].tolist()
    stands = np.array([camera["points"][0] for camera in scene["cameras"]])
    views = [one.view.world_from_camera.matrix()[:3, 3] for one in scored_views(result)]
    np.testing.assert_allclose(stands, scale * np.array(views) + shift, atol=1e-4)


PROBE = """<script>
const canvas = document.getElementById("turntable");
window.requestAnimationFrame = (draw) => draw();  // at once: nothing waits for a screen
const pictures = ["a", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"].map((key) => {
  canvas.dispatchEvent(new KeyboardEvent("keydown", { key }));
  window.dispatchEvent(new Event("resize"));
  return canvas.toDataURL();
});
document.body.dataset.seen = JSON.stringify(pictures.map((one) => pictures.indexOf(one)));
</script></body>"""


def looked_at(text: str, folder: Path) -> str:
    """Return what a page has become in a browser, in which nothing may go wrong."""
    browser = shutil.which("chromium")
    assert browser is not None
    (folder / "page.html").write_text(text, encoding="utf-8")
    options = (
        "--headless --no-sandbox --disable-gpu --use-gl=angle --use-angle=swiftshader "
        "--enable-unsafe-swiftshader --enable-logging=stderr --window-size=500,500 --dump-dom"
    )
    done = subprocess.run(
        [
            browser,
            *options.split(),
            f"--user-data-dir={folder / 'profile'}",
            (folder / "page.html").as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=90,
        check=True,
    )
    assert "Uncaught" not in done.stderr
    assert "Refused" not in done.stderr
    return done.stdout


def test_in_a_browser_the_body_turns_and_turns_back(text: str, tmp_path: Path) -> None:
    if shutil.which("chromium") is None:
        pytest.skip("there is no chromium to look at the page with")
    seen = looked_at(text.replace("</body>", PROBE), tmp_path)
    assert 'data-drawn="yes"' in seen
    assert 'data-seen="[0,1,0,3,0]"' in seen


def test_the_page_says_how_much_the_body_holds(result: ModelResult, text: str) -> None:
    found = re.search(
        r"It measures ([\d.]+) × ([\d.]+) × ([\d.]+) mm .* volume is ([\d.]+) cm³", text
    )
    assert found
    volume = 1e6 * result.body.mass_properties()[0]
    assert float(found[4]) == pytest.approx(volume, rel=1e-3)
    # The box around the body is larger than it, and smaller than that around its longest radii.
    box = float(found[1]) * float(found[2]) * float(found[3]) / 1000
    assert (
        volume
        < box
        < 1e6 * (2 * (np.abs(result.body.centers).max() + result.body.radii.max())) ** 3
    )
    assert f"fitness F {result.fitness:.4f}" in text


@pytest.mark.extended
def test_a_page_without_unused_views_does_not_speak_of_them(
    result: ModelResult, tmp_path: Path
) -> None:
    alone = replace(result, unused_views=(), iou_unused=np.empty(0), native_unused=())
    write_report(alone, tmp_path)
    body = (tmp_path / "report.html").read_text(encoding="utf-8").split("<body>")[1]
    assert "unused" not in body.split("<script>")[0]


def luminance(color: str) -> float:
    """Return the relative luminance of #rgb or #rrggbb, as WCAG 2 defines it."""
    digits = color if len(color) == 7 else "#" + "".join(2 * one for one in color[1:])
    shares = [int(digits[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


PAGES = sorted(
    path.name for path in files("servoid.view").iterdir() if path.name.endswith("report.html")
)


@pytest.mark.parametrize(
    "page",
    PAGES,
)
def test_all_letters_of_a_page_have_the_contrast_of_wcag_aa(page: str) -> None:
    colors = re.findall(r"[{;\s]color:\s*(#\w+)", fill(page, defaultdict(str)).decode())
    inks = ["#{:02x}{:02x}{:02x}".format(*color) for color in (USED_COLOR, UNUSED_COLOR)]
    assert colors
    for color in (*colors, *inks, INK, QUIET_INK):
        assert (1.0 + 0.05) / (luminance(color) + 0.05) >= 4.5, color


def test_the_contrast_is_that_of_wcag() -> None:
    assert 1.05 / (luminance("#777") + 0.05) == pytest.approx(4.48, abs=0.01)
    assert 1.05 / (luminance("#000000") + 0.05) == pytest.approx(21.0)


def test_the_page_says_first_whether_the_body_is_good_and_then_what_is_not() -> None:
    def said(fitness: float, *ious: float) -> list[str]:
        views = [SimpleNamespace(name=f"eye/{place}") for place in range(len(ious))]
        scored = [ScoredView(one, True, iou) for one, iou in zip(views, ious, strict=True)]  # type: ignore[arg-type]
        return verdict(rate_body([(one.view.name, one.iou) for one in scored], fitness), scored)

    [good] = said(0.96, 0.97, 0.9613)
    assert good.startswith("Good: the body explains 96.1 % of the worst view, eye/1, and 96.6 %")
    rough, poor = said(0.8, 0.97, 0.71, 0.75)
    assert rough.startswith("Rough: the body explains 71.0 % of the worst view, eye/1")
    assert poor.startswith("2 of 3 views have less than 80 %: eye/1, eye/2.")
    assert said(0.0, 0.0)[0].startswith("Poor: the body explains 0.0 %")
    assert "F = 0.932" in said(0.932)[0]


def test_each_head_of_a_table_says_what_it_heads() -> None:
    for page in PAGES:
        assert re.findall(r"<th(?! scope=)(?!ead)", fill(page, defaultdict(str)).decode()) == []


def test_lengths_have_as_many_decimals_each() -> None:
    assert lengths([208.0, 222.71, 164.25]) == "208 × 223 × 164"
    assert lengths([1.234, 12.34, 0.5]) == "1.2 × 12.3 × 0.5"


@pytest.fixture(scope="module")
def page_of_mesh(tmp_path_factory: pytest.TempPathFactory) -> str:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)]
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]]
    faces += [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    folder = tmp_path_factory.mktemp("mesh")
    write_report(fit_mesh(corners, faces, Request(max_ellipsoids=1)), folder)
    return (folder / "report.html").read_text(encoding="utf-8")


def test_the_page_of_a_mesh_speaks_of_no_views_and_no_cameras(page_of_mesh: str) -> None:
    heads = re.findall(r"<h2>(.*?)</h2>", page_of_mesh)
    assert heads == ["The body", "The body from five sides", "Fitness F against the count"]
    text = re.sub(r"<img[^>]*>", "", page_of_mesh)
    assert "<table>" not in text and "IoU" not in text


def test_the_page_of_a_mesh_rates_its_body_by_f_and_says_what_f_is(page_of_mesh: str) -> None:
    rated = r'class="verdict">Rough: the body fits the input with F = 0\.[67]\d+, where 1 is'
    assert re.search(rated, page_of_mesh)
    assert "F is the mean intersection over union of body and mesh, by volume" in page_of_mesh


def test_a_page_says_what_f_is_of_views_and_of_range_samples(result: ModelResult) -> None:
    samples = RangeSamples(np.zeros((3, 3)), np.ones((3, 3)))
    of_cloud = replace(result, used_views=(), iou_used=np.empty(0), range_samples=samples)
    assert "of mask and silhouette over the used views; 1 is" in _fitness_words(result)
    assert "of body and object along the range samples; 1 is" in _fitness_words(of_cloud)
    of_both = _fitness_words(replace(result, range_samples=samples))
    assert "of mask and silhouette over the used views, and of body and object along" in of_both


def test_the_worst_view_is_red_only_if_the_body_does_not_explain_it(result: ModelResult) -> None:
    fine = "".join(_rows(scored_views(result)))
    assert 'class="worst"' in fine and "poor" not in fine
    bad = replace(result, iou_used=np.array([0.9, 0.7, *result.iou_used[2:]]))
    assert "".join(_rows(scored_views(bad))).count('class="worst poor"') == 1
    style = files("servoid.view").joinpath("report.html").read_text(encoding="utf-8")
    assert re.findall(r"tr\.(\w+) td \{[^}]*#c62f2f", style) == ["poor"]

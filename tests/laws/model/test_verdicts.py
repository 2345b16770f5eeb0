"""A body is not called good beside a message that says why it may be wrong."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from recordings import Alone, run_servoid
from scenes_model import box_around, without_masks
from tiers import tiered
from toys import seen, toy

from conftest import Command, Drawing, write_png
from servoid.capture import open_capture
from servoid.model import ModelResult, Request, fit, fit_capture
from servoid.model.verdict import rate_body
from servoid.segment import parse_target
from servoid.view import write_report
from servoid.view.scores import verdict

FINE = [("eye/0", 0.97), ("eye/1", 0.95)]


@pytest.fixture(scope="module")
def toy_body() -> ModelResult:
    views = seen(toy(0))
    images = [np.repeat(view.mask[:, :, None], 3, axis=2) for view in views]
    return fit(views, images=images, max_ellipsoids=2, delta=0.0, seed=0)


def test_a_doubt_makes_a_good_body_rough_and_no_body_better() -> None:
    assert rate_body(FINE, 0.9).word == "good"
    doubted = rate_body(FINE, 0.9, ["its mask is odd"])
    assert doubted.words.startswith("rough, as it is in doubt: the body explains 95.0 % of the")
    for iou, word in ((0.7, "rough"), (0.3, "poor")):
        views = [*FINE, ("eye/2", iou)]
        assert rate_body(views, 0.9, ["its mask is odd"]) == rate_body(views, 0.9)
        assert rate_body(views, 0.9).word == word


def test_a_body_without_views_is_rated_by_its_fitness() -> None:
    for fitness, word in ((0.85, "good"), (0.7, "rough"), (0.5, "poor")):
        assert rate_body([], fitness).words.startswith(f"{word}: the body fits the input with F = ")
    assert rate_body([], 0.9, ["its normals are odd"]).words.startswith("rough, as it is in doubt")


def test_a_view_that_the_body_does_not_fit_is_a_doubt() -> None:
    made = fit(seen(toy(0)), max_ellipsoids=1, delta=0.0, seed=0)
    ious = np.full(11, 0.99)
    ious[4] = 0.84  # above what is good, but far behind the others
    off = ModelResult(
        body=made.body, colors=made.colors, steps=made.steps, settings=made.settings, seconds=0.1,
        used_views=made.used_views, iou_used=ious,
    )  # fmt: skip
    assert "does not fit 1 of 11 used views" in off.all_doubts[0]
    assert off.all_doubts[0] in off.all_notes
    assert off.verdict.word == "rough"


def test_doubts_come_first_on_the_page_and_once(toy_body: ModelResult, tmp_path: Path) -> None:
    doubted = toy_body.doubted([None, "the moon was full"])
    assert doubted.doubts == ("the moon was full", *toy_body.doubts)
    assert doubted.notes[0] == "the moon was full"
    write_report(doubted, tmp_path, notes=[*doubted.all_notes, "a note"])
    page = (tmp_path / "report.html").read_text()
    assert page.count("the moon was full") == 1
    assert '<p class="verdict">In doubt: the moon was full.</p>' in page
    assert "<li>a note</li>" in page
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["verdict"] == "rough"
    assert summary["doubts"] == ["the moon was full"]
    assert summary["reason"] == doubted.verdict.reason


@pytest.mark.extended
def test_poses_in_millimetres_make_no_good_body(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    path = drawn_capture / "poses.csv"
    header, *lines = path.read_text().splitlines()
    rows = [line.split(",") for line in lines]
    metres = [header.split(",").index(name) for name in ("x", "y", "z")]
    for row in rows:
        for place in metres:
            row[place] = str(1000.0 * float(row[place]))
    path.write_text("\n".join([header, *map(",".join, rows), ""]))
    done = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    words = " ".join(done.out.split())
    assert "verdict rough, as it is in doubt: the body explains 9" in words
    assert words.count("poses or depths in millimetres") == 1
    assert "doubt the object is" in words


@pytest.mark.parametrize("method", tiered(["region", "paper"]))
def test_inverted_masks_make_no_good_body(
    method: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    for path in (drawn_capture / "masks").iterdir():
        write_png(path, np.asarray(255 - cv2.imread(str(path), 0), np.uint8))
    out = ("--out", tmp_path / "body.json")
    options = () if method == "region" else ("--target", "hue:215..20")
    done = servoid_command("model", drawn_capture, "--method", method, *options, *out)
    if done.code == 0:
        assert "verdict good" not in done.out
        if not options:
            assert "doubt 8 masks of 8 touch all four" in " ".join(done.out.split())
    else:
        assert "black and white swapped" in " ".join(done.err.split())


def test_masks_that_a_target_replaces_are_counted(drawn_capture: Path, drawing: Drawing) -> None:
    target = parse_target(f"{box_around(drawing, 3)}@eye/0003")
    request = Request(max_ellipsoids=1, delta=0.0)
    told = fit_capture(open_capture(drawn_capture), request, targets=[target]).notes
    assert any("instead of the capture's own 8 masks; leave it out" in note for note in told)
    unmarked = open_capture(without_masks(drawn_capture))
    told = fit_capture(unmarked, request, targets=[target]).notes
    assert not any("own" in note for note in told)


def test_a_doubt_is_on_the_page_though_no_view_is_rated() -> None:
    rated = rate_body([], 0.9, ["its box is odd"])
    assert verdict(rated, [], ["its box is odd"])[1:] == ["In doubt: its box is odd."]


def test_a_track_is_in_doubt_if_the_first_masks_look_inverted(alone: Alone, tmp_path: Path) -> None:
    folder = tmp_path / "recording"
    shutil.copytree(alone.recording.folder, folder)
    for path in (folder / "masks").rglob("*.png"):
        write_png(path, np.asarray(255 - cv2.imread(str(path), 0), np.uint8))
    body = alone.folder / "body.json"
    told = run_servoid(tmp_path, "track", folder, "--observations", ":2", "--body", body)
    words = " ".join(told.split())
    assert "verdict good" not in words
    assert "are black and white swapped" in words

"""A body of a capture whose scale is unknown is nowhere told, or used, in metres."""

import json
from pathlib import Path

import pytest
from commands import Command
from recordings import Alone

from servoid.capture import open_capture
from servoid.model import fit
from servoid.shape import load_body


@pytest.fixture
def unscaled(drawn_capture: Path) -> Path:
    """Let the capture of the drawing say that nothing tells its scale."""
    path = drawn_capture / "capture.toml"
    path.write_text(path.read_text().replace("version = 1", "version = 1\nmetric = false", 1))
    return drawn_capture


def test_its_file_page_and_exports_name_no_metres(
    unscaled: Path, tmp_path: Path, servoid_command: Command
) -> None:
    body, report = tmp_path / "body.json", tmp_path / "report"
    few = ("--max-ellipsoids", 2, "--delta", 0)
    done = servoid_command("model", unscaled, *few, "--out", body, "--report", report)
    assert done.code == 0, done.err
    assert "lengths are not in metres" in " ".join(done.out.split())
    assert max(len(line) for line in done.out.splitlines() if str(tmp_path) not in line) <= 80
    assert json.loads(body.read_text())["units"] == "unknown"
    assert not load_body(body).is_metric
    page = (report / "report.html").read_text(encoding="utf-8")
    assert " of an unknown unit along x, y and z" in page and "cubic units" in page
    assert " mm along" not in page and "cm³" not in page
    done = servoid_command("export", body, "--out", tmp_path / "body.urdf")
    assert done.code == 0, done.err
    assert "the lengths of the body are in an unknown unit" in " ".join(done.out.split())


def test_a_body_of_its_views_is_not_in_metres_in_python_either(unscaled: Path) -> None:
    views = open_capture(unscaled).views()
    assert not fit(views, max_ellipsoids=1, delta=0.0, seed=0).is_metric


def test_a_track_with_it_in_metres_is_doubted_and_saves_it_as_it_is(
    alone: Alone, tmp_path: Path, servoid_command: Command
) -> None:
    text = (alone.folder / "body.json").read_text()
    assert '"units": "m"' in text
    body = tmp_path / "body.json"
    body.write_text(text.replace('"units": "m"', '"units": "unknown"'))
    saved, poses = tmp_path / "saved.json", tmp_path / "poses.csv"
    done = servoid_command(
        "track", alone.recording.folder, "--body", body, "--observations", ":2", "--out", poses,
        "--save-body", saved,
    )  # fmt: skip
    assert done.code == 0, done.err
    words = " ".join(done.out.split())
    assert "the lengths of the body are in an unknown unit, not in metres" in words
    assert "verdict good" not in words and "what was found at first is in doubt" in words
    assert not load_body(saved).is_metric

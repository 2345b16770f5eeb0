"""Each verb of the command once, in a process of its own; `servoid servo` is in test_cli_servo."""

from pathlib import Path

import cv2
import pyarrow.parquet
import pytest

pytest.importorskip("matplotlib", reason="reports and studies need matplotlib")
pytest.importorskip("trimesh", reason="a mesh to export to needs trimesh")

from recordings import run_apart

from servoid import __version__
from servoid.capture import open_capture
from servoid.record import read_trajectory
from servoid.servo import settings_toml
from servoid.shape import load_body
from servoid_experiments.modelling.study import (
    CenterSettings,
    ModelStudySettings,
    SweepSettings,
)

NOTHING = dict.fromkeys(SweepSettings.__struct_fields__, ())
TINY = ModelStudySettings(
    objects=("two_ellipsoids",),
    seeds=1,
    size_px=(160, 120),
    center=CenterSettings(views=4, ellipsoids=1),
    sweep=SweepSettings(**NOTHING | {"views": (2,)}),  # type: ignore
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("verbs")


@pytest.fixture(scope="module")
def snail(folder: Path) -> Path:
    run_apart(folder, "sample", "snail", "--moving", "--size", "small", "--count", 3)
    return folder / "snail"


@pytest.fixture(scope="module")
def body(folder: Path, snail: Path) -> Path:
    run_apart(folder, "model", snail, "--max-ellipsoids", 1, "--out", "body.json", "--report", "r")
    return folder / "body.json"


def test_sample_draws_a_capture(snail: Path) -> None:
    assert len(open_capture(snail).all_views()) == 6


def test_model_writes_a_body_and_a_report(folder: Path, body: Path) -> None:
    assert len(load_body(body).body()) == 1
    assert "<html" in (folder / "r" / "report.html").read_text()


def test_track_follows_that_body_into_a_file_and_a_video(
    folder: Path, snail: Path, body: Path
) -> None:
    run_apart(folder, "track", snail, "--body", body, "--out", "poses.csv", "--video", "track.mp4")
    assert [one.observation for one in read_trajectory(folder / "poses.csv")] == [0, 1, 2]
    assert cv2.VideoCapture(str(folder / "track.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) == 3


def test_export_writes_that_body_for_others(folder: Path, body: Path) -> None:
    output = run_apart(folder, "export", body, "--out", "body.urdf")
    assert output.startswith("Wrote body.urdf")
    assert "<robot" in (folder / "body.urdf").read_text()


def test_study_runs_its_trials_and_tells_of_them(folder: Path) -> None:
    (folder / "tiny.toml").write_text(settings_toml(TINY))
    run_apart(folder, "study", "model", "--config", "tiny.toml", "--out", "told", "--workers", 1)
    assert "<html" in next(folder.glob("told/model/*.html")).read_text()
    [table] = folder.glob("told/model/*.parquet")
    assert pyarrow.parquet.read_table(table).num_rows == 2


def test_doctor_tells_the_version(folder: Path) -> None:
    assert run_apart(folder, "doctor", "--no-test").splitlines()[0].split() == [
        "servoid",
        __version__,
    ]

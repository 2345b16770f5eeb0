"""Laws of outputs that are inputs, or other outputs, of the same command."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from drawn_pairs import Pair
from fake_tracker import plain_body

from conftest import Command, everything_in
from servoid.cli.overwriting import check_inputs_kept, check_inputs_outside
from servoid.cli.wrong_options import OptionError
from servoid.opening import belongs_to_source, parse_source
from servoid.pose import Pose
from servoid.record import image_video
from servoid.shape import save_body

CUP = ("--body", "cup.json", "--start", "body")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder with a capture, a film, a body, and links to them."""
    Pair(centers=((0.01, 0.0, 0.4), (0.02, 0.0, 0.4))).write(tmp_path / "capture", rate_hz=10.0)
    save_body(tmp_path / "cup.json", plain_body(Pose.identity()))
    with image_video(tmp_path / "film.mp4", (64, 48), 10.0) as add:
        add(np.zeros((48, 64, 3), np.uint8))
    (tmp_path / "link.mp4").symlink_to("film.mp4")
    (tmp_path / "link.csv").symlink_to("capture/poses.csv")
    (tmp_path / "link.json").symlink_to("cup.json")
    (tmp_path / "rig.mcap").write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("command", "named"),
    [
        (("track", "capture", *CUP, "--out", "capture/poses.csv"), "--out"),
        (("track", "capture", *CUP, "--out", "link.csv"), "--out"),
        (("track", "capture/capture.toml", *CUP, "--smooth", "capture/poses.csv"), "--smooth"),
        (("track", "capture", *CUP, "--video", "capture/left/a.mp4"), "--video"),
        (("track", "capture", *CUP, "--save-body", "cup.json"), "--save-body"),
        (("track", "capture", *CUP, "--save-body", "link.json"), "--save-body"),
        (("track", "film.mp4", "--fov", "60", *CUP, "--video", "film.mp4"), "--video"),
        (("track", "film.mp4", "--fov", "60", *CUP, "--video", "link.mp4"), "--video"),
        (("track", "rig.mcap", *CUP, "--mcap", "rig.mcap"), "--mcap"),
        (("record", "rig.mcap", "--out", "rig.mcap"), "--out"),
        (("model", "capture", "--out", "capture/left/b.json"), "--out"),
        (("pick", "capture", "--mask", "capture/left/000000.png", "--no-browser"), "--mask"),
        (("export", "cup.json", "--to", "obj", "--out", "cup.json"), "cup.json"),
        (("servo", "--config", "run/run.toml", "--out", "run"), "--out"),
        (("servo", "--path", "recorded:run/log.csv", "--out", "run"), "run/log.csv"),
        (("model", "capture", "--out", "b.json", "--report", "b.json"), "--out and --report"),
        (("track", "capture", *CUP, "--out", "p.csv", "--report", "p.csv"), "--out and --report"),
    ],
)
def test_an_output_that_the_command_reads_or_writes_twice_is_refused_and_unchanged(
    command: tuple[str, ...], named: str, folder: Path, servoid_command: Command
) -> None:
    (folder / "run").mkdir()
    (folder / "run/run.toml").write_text("[run]\nseconds = 1.0\n")
    shutil.copy("capture/poses.csv", "run/log.csv")
    before = everything_in(folder)
    outcome = servoid_command(*command)
    assert (outcome.code, outcome.out) == (2, ""), outcome.err
    assert named in outcome.err and outcome.err.count("\n") == 1
    assert everything_in(folder) == before


def test_a_capture_is_not_overwritten_by_tracking_it_in_its_own_folder(
    folder: Path, servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder / "capture")
    before = everything_in(folder)
    outcome = servoid_command("track", ".", "--body", "../cup.json", "--start", "body")
    assert outcome.code == 2
    assert outcome.err == (
        "error: --out would write over what this command reads: poses.csv belongs to SOURCE "
        "'.'; give --out another path\n"
    )
    assert everything_in(folder) == before


@pytest.mark.usefixtures("folder")
def test_other_files_in_the_folder_of_a_capture_are_the_users() -> None:
    word = parse_source("capture")
    for name in ("mine.csv", "mine/poses.csv", "report", "body.json", "leftover/a.png"):
        Path("capture", name).parent.mkdir(exist_ok=True)
        assert not belongs_to_source(Path("capture", name), word), name
    for name in ("capture.toml", "images.csv", "left", "left/deeper/a.csv"):
        assert belongs_to_source(Path("capture", name), word), name


def test_the_tables_of_other_captures_belong_to_them(tmp_path: Path) -> None:
    (tmp_path / "transforms.json").write_text("{}")
    word = parse_source(str(tmp_path))
    for name in ("transforms.json", "sparse/0/images.txt", "images/a.png", "rgb"):
        assert belongs_to_source(tmp_path / name, word), name
    for name in ("body.json", "poses.csv", "out/a.mp4"):
        assert not belongs_to_source(tmp_path / name, word), name


def test_a_mesh_has_no_folder_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "cup.ply").write_text("ply\n")
    word = parse_source(str(tmp_path / "cup.ply"))
    assert belongs_to_source(tmp_path / "cup.ply", word)
    assert not belongs_to_source(tmp_path / "images" / "cup.json", word)


def test_a_folder_that_is_replaced_holds_no_input(folder: Path) -> None:
    for place in ("capture", "capture/left"):
        with pytest.raises(OptionError, match="--out would write over what this command reads"):
            check_inputs_outside(("--out", folder / "capture"), [folder / place, None])
    check_inputs_outside(("--out", folder / "other"), [folder / "capture"])


def test_an_input_that_does_not_exist_is_compared_by_its_path(tmp_path: Path) -> None:
    shutil.rmtree(tmp_path)
    with pytest.raises(OptionError):
        check_inputs_kept([("--out", tmp_path / "a" / ".." / "b")], None, [tmp_path / "b"])
    check_inputs_kept([("--out", None), ("--out", tmp_path / "a")], None, [tmp_path / "b", None])

"""`servoid model --each`, through the command line."""

import os
import re
import shutil
from pathlib import Path

import pytest

pytest.importorskip("pyarrow", reason="tables of trials need pyarrow")

import cv2
import numpy as np
import pyarrow.parquet

from conftest import Command, Drawing, write_png
from servoid.output import claimed

FAST = ("--max-ellipsoids", "2", "--delta", "0", "--views", "::4")


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of two captures, one that is broken, and one that is none."""
    folder = tmp_path_factory.mktemp("captures")
    Drawing().write(folder / "bird")
    shutil.copytree(folder / "bird", folder / "same")
    shutil.copytree(folder / "bird", folder / "torn")
    for image in (folder / "torn").rglob("*.png"):
        image.unlink()
    (folder / "empty").mkdir()
    return folder


def test_each_capture_gives_the_body_that_it_gives_alone(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    ran = servoid_command(
        "model", captures, "--each", "--out", tmp_path / "all", "--workers", 2, *FAST
    )
    assert ran.code == 1
    assert "torn: " in ran.out
    assert "matches no file" in ran.out
    assert "1 of 3 captures could not be modelled" in ran.err
    assert "empty holds no capture" in ran.out
    assert all(len(line) <= 80 for line in ran.out.splitlines() if str(tmp_path) not in line
               and "torn: " not in line)  # fmt: skip
    alone = servoid_command("model", captures / "bird", "--out", tmp_path / "bird.json", *FAST)
    assert alone.code == 0
    for name in ("bird", "same"):
        assert (tmp_path / "all" / f"{name}.json").read_bytes() == (
            tmp_path / "bird.json"
        ).read_bytes()
    assert not (tmp_path / "all" / "torn.json").exists()
    table = pyarrow.parquet.read_table(tmp_path / "all" / "captures.parquet").to_pydict()
    assert table["ellipsoids"] == [2, 2, None]
    assert [bool(failure) for failure in table["failure"]] == [False, False, True]


def test_each_capture_has_the_notes_that_it_has_alone(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    folder = tmp_path / "captures"
    shutil.copytree(captures / "bird", folder / "bird")
    shutil.copytree(captures / "bird", folder / "plain")
    toml = folder / "bird" / "capture.toml"
    toml.write_text(toml.read_text().replace("version = 1", "version = 1\nmetric = false"))
    for mask in (folder / "bird" / "masks").iterdir():
        write_png(mask, np.asarray(255 - cv2.imread(str(mask), 0), np.uint8))
    ran = servoid_command("model", folder, "--each", "--out", tmp_path / "all", *FAST)
    alone = servoid_command("model", folder / "bird", "--out", tmp_path / "bird.json", *FAST)
    assert ran.code == alone.code == 0
    words, own = (" ".join(done.out.split()) for done in (ran, alone))
    notes = [
        one.strip() for one in re.findall(r" (?:note|doubt) (.+?)(?= ellipsoids | note |$)", own)
    ]
    assert len(notes) >= 2
    assert any("black and white swapped" in note for note in notes)
    for note in notes:
        assert f"bird: {note}" in words
    assert "plain: lengths" not in words
    assert all(len(line) <= 80 for line in ran.out.splitlines() if str(tmp_path) not in line)


def test_a_capture_that_was_modelled_is_modelled_again_only_if_it_changed(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    folder = tmp_path / "captures"
    shutil.copytree(captures / "bird", folder / "bird")
    command = ("model", folder, "--each", "--out", tmp_path / "all", "--workers", 1, *FAST)
    for _ in range(2):
        assert servoid_command(*command).code == 0
        assert len(list((tmp_path / "all" / "trials" / "captures").iterdir())) == 1
    (folder / "bird" / "capture.toml").touch()
    assert servoid_command(*command).code == 0
    assert len(list((tmp_path / "all" / "trials" / "captures").iterdir())) == 2


def test_a_body_of_an_earlier_run_is_named_as_such(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    folder = tmp_path / "captures"
    shutil.copytree(captures / "bird", folder / "bird")
    command = ("model", folder, "--each", "--out", tmp_path / "all", "--workers", 1, *FAST)
    assert servoid_command(*command).code == 0
    assert (tmp_path / "all" / "bird.json").is_file()
    for mask in (folder / "bird").rglob("masks/**/*.png"):
        mask.write_text("no image")
    shutil.copy(tmp_path / "all" / "bird.json", tmp_path / "all" / "gone.json")
    (tmp_path / "all" / "other.json").write_text("{}")
    shutil.copytree(folder / "bird", folder / ".hidden")
    ran = servoid_command(*command)
    assert ran.code == 1
    assert "bird.json is of an earlier run, not of this one" in ran.out
    assert "gone.json is of an earlier run, not of this one" in ran.out
    assert "all/NAME.json, of 0 of 1" in ran.out
    assert "other.json" not in ran.out
    assert ".hidden" not in ran.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("model", "{}/empty", "--each", "--out", "{}/out"), "no folder in"),
        (("model", "{}/nowhere", "--each", "--out", "{}/out"), "there is no folder"),
        (("model", "{}", "--each", "--out", "{}/out", "--report", "r"), "--report does not apply"),
        (
            ("model", "{}", "--each", "--out", "{}/out.json"),
            "into a folder, but {}/out.json is the name of a single body; give a folder, such as "
            "--out {}/out",
        ),
        (("model", "{}", "--out", "{}/out.json", "--workers", "2"), "add --each"),
        (
            ("model", "{}", "--each", "--out", "{}/out", "--workers", "2", "--cluster", "a:1"),
            "leave one of the two out",
        ),
    ],
)
def test_what_cannot_be_is_told_in_a_line(
    captures: Path, arguments: tuple[str, ...], message: str, servoid_command: Command
) -> None:
    ran = servoid_command(*(part.format(captures) for part in arguments))
    assert ran.code in (1, 2)
    assert message.replace("{}", str(captures)) in " ".join(ran.err.replace("│", " ").split())
    assert "Traceback" not in ran.err
    assert not (captures / "out.json").exists()


def test_a_folder_into_which_another_run_writes_is_refused(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (tmp_path / "all").mkdir()
    with claimed(tmp_path / "all"):
        ran = servoid_command("model", captures, "--each", "--out", tmp_path / "all", *FAST)
    assert ran.code == 1
    assert "another run is writing into" in ran.err
    assert list((tmp_path / "all").iterdir()) == []


def test_a_capture_whose_name_is_not_utf_8_is_named_or_reported_on_a_page(
    captures: Path, tmp_path: Path, servoid_command: Command
) -> None:
    odd = tmp_path / "captures" / os.fsdecode(b"caf\xe9")
    shutil.copytree(captures / "bird", odd)
    ran = servoid_command("model", odd.parent, "--each", "--out", tmp_path / "all", *FAST)
    assert ran.code == 1
    assert "is not UTF-8, and cannot be stored in a table; rename the folder" in ran.err
    alone = ("--out", tmp_path / "body.json", "--report", tmp_path / "report")
    ran = servoid_command("model", odd, *alone, *FAST)
    assert ran.code == 0, ran.err
    assert "caf" in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")


def test_bodies_are_not_written_into_a_capture_that_is_modelled(
    captures: Path, servoid_command: Command
) -> None:
    for out in (captures / "bird", captures / "bird" / "images"):
        ran = servoid_command("model", captures, "--each", "--out", out, *FAST)
        assert ran.code == 2
        assert "--out would write over what this command reads" in " ".join(ran.err.split())
    assert not (captures / "bird" / "trials").exists()

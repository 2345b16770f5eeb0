"""Every output that cannot be written: found before the work, and nothing left behind."""

import os
from pathlib import Path

import pytest
from refusals import check_refused

from conftest import Command


@pytest.mark.parametrize(
    ("out", "message", "code"),
    [
        ("none/body.json", r"there is no folder .*none; make it first", 1),
        ("body.txt", r"the file of a body ends in \.json", 2),
        ("photos.json", r"photos\.json: it is a folder; name a file in it", 1),
        ("file/body.json", r"there is no folder .*file; make it first", 1),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    out: str, message: str, code: int, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (tmp_path / "photos.json").mkdir()
    (tmp_path / "file").write_text("")
    (drawn_capture / "capture.toml").write_text("would be the error if it were read")
    check_refused(
        servoid_command, tmp_path, message, "model", drawn_capture, "--out", tmp_path / out,
        code=code,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("report", "message"),
    [("file", r"file: it is a file; name a folder"), ("none/report", r"there is no folder .*none")],
)
def test_a_report_that_cannot_be_written_is_refused_before_the_work(
    report: str, message: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (tmp_path / "file").write_text("")
    check_refused(
        servoid_command, tmp_path, message,
        "model", drawn_capture, "--out", tmp_path / "body.json", "--report", tmp_path / report,
    )  # fmt: skip


@pytest.mark.parametrize("option", ["--out", "--report"])
def test_a_folder_that_is_read_only_is_refused(
    option: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    locked = tmp_path / "locked"
    locked.mkdir()
    locked.chmod(0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write into a folder that is read-only")
    asked = {"--out": tmp_path / "body.json"} | {option: locked / "body.json"}
    arguments = [part for pair in asked.items() for part in pair]
    check_refused(
        servoid_command, tmp_path, "permission denied", "model", drawn_capture, *arguments
    )

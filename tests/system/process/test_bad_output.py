"""Every output that cannot be written: found before the work, and nothing left behind."""

import errno
import os
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from refusals import check_refused

from conftest import Command
from servoid.errors import OutputError
from servoid.output import check_file, write_whole, written_beside


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
def test_a_name_that_is_too_long_is_refused(
    option: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    asked = {"--out": tmp_path / "body.json"} | {option: tmp_path / f"{'long' * 70}.json"}
    arguments = [part for pair in asked.items() for part in pair]
    check_refused(
        servoid_command, tmp_path, r"\.\.\.: file name too long; choose a shorter name",
        "model", drawn_capture, *arguments,
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


@pytest.mark.parametrize("number", [errno.EACCES, errno.EPERM, errno.EROFS])
@pytest.mark.parametrize("command", ["sample", "scan"])
def test_a_capture_in_a_folder_that_is_read_only_is_refused_with_what_to_do(
    command: str,
    number: int,
    tmp_path: Path,
    servoid_command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forbidden(*_: object, **__: object) -> str:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(tempfile, "mkdtemp", forbidden)
    film = tmp_path / "film.avi"
    film.touch()
    arguments = ("sample", "new") if command == "sample" else ("scan", film, "--out", "new")
    done = servoid_command(*arguments)
    assert done.code == 1
    assert done.err.startswith(f"error: cannot write a {command} into new: ")
    assert done.err.endswith("; choose a folder that you may write to\n")


@pytest.fixture(params=["pipe", "socket", "link to a pipe", "link to a device"])
def no_file(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Path]:
    """Make something that is no file and has the name of a body."""
    path, pipe = tmp_path / "body.json", tmp_path / "pipe"
    with socket.socket(socket.AF_UNIX) as server:
        if request.param == "socket":
            server.bind(os.path.relpath(path))  # the path of a socket is limited to 108 bytes
        elif request.param == "pipe":
            os.mkfifo(path)
        else:
            os.mkfifo(pipe)
            path.symlink_to(pipe if request.param == "link to a pipe" else "/dev/null")
        yield path


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_is_no_file_is_never_replaced_by_one(no_file: Path) -> None:
    before = no_file.stat()
    message = r"cannot write .*body\.json: .* is a (device|pipe|socket), which a file would replace"
    with pytest.raises(OutputError, match=message):
        check_file(no_file)
    with pytest.raises(OutputError, match=message):
        write_whole(no_file, b"{}")
    with pytest.raises(OutputError, match=message), written_beside(no_file) as partial:
        partial.write_bytes(b"{}")
    after = no_file.stat()
    assert (after.st_ino, after.st_mode) == (before.st_ino, before.st_mode)
    assert {path.name for path in no_file.parent.iterdir()} <= {"body.json", "pipe"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_as_an_output_is_refused_before_the_work(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    os.mkfifo(tmp_path / "body.json")
    (drawn_capture / "capture.toml").write_text("would be the error if it were read")
    check_refused(
        servoid_command, tmp_path, r"body\.json: it is a pipe, which a file would replace",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip

"""Messages on a terminal end their lines between words; those in a pipe are one line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.cli.messages import in_lines, print_message

WORDS = st.lists(st.text("ab:;,-/'.", min_size=1, max_size=30), min_size=1).map(" ".join)


@given(WORDS, st.integers(20, 120))
def test_a_message_in_lines_has_the_same_words_and_no_line_that_could_end_earlier(
    message: str, columns: int
) -> None:
    lines = in_lines(message, columns).split("\n")
    assert " ".join(lines) == message
    assert all(len(line) <= columns or " " not in line for line in lines)


@pytest.mark.parametrize(
    "command",
    [
        "such as: servoid track film.mp4 --target box:120,80,420,400 --fov 65 --distance 0.6; or",
        "install with: pip install 'servoid[view]'",
        "install with: apt-get install libegl1 libgl1 libopengl0, or else",
        "make one with servoid model mesh.ply --out mesh.json",
    ],
)
@pytest.mark.parametrize("columns", [20, 40, 80])
def test_a_command_to_copy_stays_in_one_line(command: str, columns: int) -> None:
    said = in_lines(f"error: something is wrong here and there; {command} all the same", columns)
    copied = command.partition(": ")[2] or command.partition("with ")[2]
    assert copied.partition(";")[0].partition(", or")[0] in said


def test_a_narrow_terminal_gets_the_message_as_it_is() -> None:
    assert in_lines("error: a b c", 5) == "error: a b c"


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_message_is_wrapped_on_a_terminal_only(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal, raising=False)
    print_message("error: " + 20 * "one " + "path/of/a/file")
    said = capsys.readouterr().err
    assert (said.count("\n") > 1) == is_terminal
    assert " ".join(said.split("\n")).split() == ["error:", *20 * ["one"], "path/of/a/file"]


@pytest.mark.skipif(os.name != "posix", reason="a pseudo-terminal is POSIX's")
@pytest.mark.extended  # each starts a process
@pytest.mark.parametrize("is_terminal", [True, False])
def test_an_error_is_wrapped_on_a_terminal_only(is_terminal: bool, tmp_path: Path) -> None:
    ours, theirs = os.openpty() if is_terminal else os.pipe()
    command = [sys.executable, "-m", "servoid", "export", "nowhere.json", "--out", "b.urdf"]
    ran = subprocess.run(
        command, cwd=tmp_path, env=os.environ | {"COLUMNS": "40"}, stderr=theirs, stdout=theirs
    )
    text = os.read(ours, 10_000).decode().replace("\r\n", "\n")
    for end in {ours, theirs}:
        os.close(end)
    lines = text.splitlines()
    assert ran.returncode == 1
    assert " ".join(lines).startswith("error: cannot read nowhere.json: no such file or directory")
    assert (len(lines) > 1) == is_terminal
    assert not is_terminal or max(map(len, lines)) <= 40

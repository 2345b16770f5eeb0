"""Every verb ends with 2 for its options, 1 for what they name, and 70 for a bug of servoid."""

import errno
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import wraps
from pathlib import Path
from typing import Any

import pytest
import typer

from conftest import Command, everything_in
from servoid.cli.app import app

OUT = ("--out", "out.json")
# Of each verb options that no files can make right.
OPTIONS: dict[str, tuple[str, ...]] = {
    "demo": ("--colour", "red"),
    "doctor": ("--jsn",),
    "export": ("body.json", "--out", "b.obj", "--density", "-1"),
    "model": ("photos", *OUT, "--views", "abc"),
    "pick": ("film.mp4", "--port", "99999999"),
    "record": ("0", "--out", "r", "--duration", "-1"),
    "sample": ("drawn", "--count", "0"),
    "scan": ("film.mp4", "--out", "s", "--fov", "400"),
    "servo": ("--seconds", "-1"),
    "sources": ("--all",),
    "study": ("nothing", "--out", "s"),
    "track": ("photos", "--budget-ms", "nan"),
}
# Of each verb what names a file that is missing or in the way; the others take none.
INPUTS: dict[str, tuple[str, ...]] = {
    "demo": ("--out", "file"),
    "export": ("nowhere.json", "--out", "b.obj"),
    "model": ("nowhere", *OUT),
    "pick": ("nowhere",),
    "record": ("nowhere", "--out", "r"),
    "sample": ("file",),
    "scan": ("nowhere", "--out", "s"),
    "servo": ("--config", "nowhere.toml", "--out", "s"),
    "study": ("model", "--out", "file"),
    "track": ("nowhere",),
}
VERBS = sorted(OPTIONS)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "file").touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_verb_is_tried() -> None:
    assert set(VERBS) == set(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    assert set(VERBS) - set(INPUTS) == {"doctor", "sources"}


@pytest.mark.parametrize("verb", VERBS)
def test_wrong_options_end_with_2(verb: str, folder: Path, servoid_command: Command) -> None:
    before = everything_in(folder)
    outcome = servoid_command(verb, *OPTIONS[verb])
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.strip()
    assert everything_in(folder) == before


@pytest.mark.parametrize("verb", INPUTS)
def test_what_is_missing_or_in_the_way_ends_with_1(
    verb: str, folder: Path, servoid_command: Command
) -> None:
    before = everything_in(folder)
    outcome = servoid_command(verb, *INPUTS[verb])
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith("error: ") and outcome.err.count("\n") == 1
    assert any(word in outcome.err for word in INPUTS[verb])
    assert everything_in(folder) == before


def stumbling(callback: Callable[..., Any], error: Exception) -> Callable[..., Any]:
    """Return a command with the same options that raises an error."""

    @wraps(callback)
    def stumble(*_: object, **__: object) -> None:
        raise error

    return stumble


def trip(verb: str, error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a verb raise an error, whatever it is given."""
    [command] = [
        one
        for one in app.registered_commands
        if one.callback is not None and (one.name or one.callback.__name__) == verb
    ]
    assert command.callback is not None
    monkeypatch.setattr(command, "callback", stumbling(command.callback, error))


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.usefixtures("folder")
def test_a_bug_ends_with_70(
    verb: str, servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    trip(verb, ZeroDivisionError("two\nlines"), monkeypatch)
    outcome = servoid_command(verb, *INPUTS.get(verb, ()))
    assert (outcome.code, outcome.out) == (70, "")
    assert "this is a bug in servoid, please report it: ZeroDivisionError: two lines" in outcome.err
    assert outcome.err.count("\n") == 1


@pytest.mark.usefixtures("folder")
def test_memory_that_ends_is_no_bug(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    trip("model", MemoryError(), monkeypatch)
    outcome = servoid_command("model", *INPUTS["model"])
    assert (outcome.code, outcome.out) == (1, "")
    assert outcome.err.startswith("error: out of memory; ")
    assert outcome.err.count("\n") == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no device that is full")
@pytest.mark.parametrize("arguments", [("servo", "--print-config"), ("--help",), ("--version",)])
def test_text_that_cannot_be_printed_is_no_bug(
    arguments: tuple[str, ...], servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = Path("/dev/full").open("w")  # noqa: SIM115 - closing it fails as printing does
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", full)
        outcome = servoid_command(*arguments)
    with suppress(OSError):
        full.close()
    assert outcome.code == 1
    assert outcome.err == (
        "error: cannot write to standard output: no space left on device; make room there, or "
        "redirect the output to another place\n"
    )


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    "error", [OSError(errno.EBADF, "bad"), OSError(errno.ENOSPC, "no space left", "a.csv")]
)
def test_other_errors_of_the_system_are_bugs(
    error: OSError, servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    trip("sources", error, monkeypatch)
    outcome = servoid_command("sources")
    assert outcome.code == 70 and "this is a bug in servoid" in outcome.err

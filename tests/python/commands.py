"""Runs commands in this process, for tests of the package and of the experiments."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from servoid.cli import main


@dataclass(frozen=True)
class Outcome:
    """How a command ended, and what it said."""

    code: int
    out: str
    err: str


Command = Callable[..., Outcome]


@pytest.fixture
def servoid_command(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run `servoid ARGUMENTS` in this process, in a terminal 80 columns wide."""
    monkeypatch.setenv("COLUMNS", "80")
    # On a machine that is busy any command may take long enough to say how far it is.
    monkeypatch.setattr("servoid.cli.progress._LINE_S", 1e6)

    def run(*arguments: object) -> Outcome:
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        code = ended.value.code
        return Outcome(code if isinstance(code, int) else int(code is not None), out, err)

    return run

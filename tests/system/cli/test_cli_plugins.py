"""Commands that other packages bring, and what stands in place of one that is not installed."""

from importlib.metadata import EntryPoint

import pytest
import typer
from typer.testing import CliRunner

from servoid import __version__
from servoid.cli import plugins
from servoid.errors import MissingExtraError, ServoidError


def app_with(monkeypatch: pytest.MonkeyPatch, *entries: EntryPoint) -> typer.Typer:
    """Return a command line on a machine where these entry points are installed."""

    def found(group: str) -> list[EntryPoint]:
        return [entry for entry in entries if entry.group == group]

    monkeypatch.setattr(plugins, "entry_points", found)
    app = typer.Typer()
    app.command("other")(lambda: None)
    plugins.add_commands(app)
    return app


def greet(name: str) -> None:
    """Greet somebody."""
    typer.echo(f"hello {name}")


def test_a_command_of_another_package_is_added_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("hail", f"{__name__}:greet", plugins.GROUP)
    elsewhere = EntryPoint("study", f"{__name__}:greet", "console_scripts")
    app = app_with(monkeypatch, entry, elsewhere)
    assert CliRunner().invoke(app, ["hail", "you"]).output == "hello you\n"
    assert "hail" in CliRunner().invoke(app, ["--help"]).output


@pytest.mark.parametrize(
    "arguments", [(), ("paper", "--quick", "--out", "results"), ("--help",), ("--print-config",)]
)
def test_without_the_experiments_study_says_in_one_line_what_brings_it(
    monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...]
) -> None:
    ran = CliRunner().invoke(app_with(monkeypatch), ["study", *arguments])
    assert isinstance(ran.exception, MissingExtraError)
    assert str(ran.exception).endswith("install it with: pip install ./experiments")
    assert "\n" not in str(ran.exception)


def test_a_command_that_is_not_installed_is_not_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "study" not in CliRunner().invoke(app_with(monkeypatch), ["--help"]).output


@pytest.mark.parametrize("place", ["no_such_module:study", f"{__name__}:no_such_function"])
def test_a_package_that_does_not_fit_spoils_its_own_command_only(
    monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    app = app_with(monkeypatch, EntryPoint("study", place, plugins.GROUP))
    assert CliRunner().invoke(app, ["other"]).exit_code == 0
    ran = CliRunner().invoke(app, ["study", "paper", "--quick"])
    assert isinstance(ran.exception, ServoidError)
    assert f"does not fit servoid {__version__}" in str(ran.exception)
    assert "no_such" in str(ran.exception)

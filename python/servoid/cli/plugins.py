"""Adds commands to `servoid` that other packages declare as entry points."""

from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, NoReturn

import typer

from servoid._native import __version__
from servoid.cli.flags import CommandWithFlags
from servoid.errors import MissingExtraError, ServoidError

GROUP = "servoid.commands"
_STUDY = "study"
_ANYTHING = {"ignore_unknown_options": True, "help_option_names": []}


def add_commands(app: typer.Typer) -> None:
    """Add the commands of installed packages.

    An entry point in the group `servoid.commands` has the name of the command, and refers to a
    function whose parameters are its options. A command that cannot be loaded reports so when it
    is called, and affects no other command. Servoid's own commands, which must have been added
    before, are not replaced.
    """
    own = {one.name or one.callback.__name__ for one in app.registered_commands if one.callback}
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(found.items()):
        if name in own:
            continue
        try:
            app.command(name, cls=CommandWithFlags)(entry.load())
        except Exception as error:  # any error of another package
            _add_refusal(app, name, _unfit(entry, error))
    if _STUDY not in found:
        missing = MissingExtraError(
            "servoid study needs servoid-experiments, which is not installed, and not on a package "
            "index yet; it is the folder experiments of servoid's repository: in a clone of the "
            f"version {__version__}, install it with: pip install ./experiments"
        )
        _add_refusal(app, _STUDY, missing)


def _unfit(entry: EntryPoint, error: Exception) -> ServoidError:
    """Return the error message for a command whose package does not fit."""
    package = "another package" if entry.dist is None else entry.dist.name
    return ServoidError(
        f"servoid {entry.name} comes from {package}, which does not fit servoid {__version__} "
        f"({error}); install both in the same version"
    )


def _add_refusal(app: typer.Typer, name: str, error: ServoidError) -> None:
    """Add a command that takes any arguments and raises an error."""

    def refuse(_arguments: Annotated[list[str] | None, typer.Argument()] = None) -> NoReturn:
        raise error

    app.command(name, hidden=True, context_settings=_ANYTHING)(refuse)

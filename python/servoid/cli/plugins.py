"""Adds commands of other packages to `servoid`, which name them as entry points."""

from importlib.metadata import EntryPoint, entry_points
from typing import Annotated, NoReturn

import typer

from servoid._native import __version__
from servoid.errors import MissingExtraError, ServoidError

GROUP = "servoid.commands"
_STUDY = "study"
_ANYTHING = {"ignore_unknown_options": True, "help_option_names": []}


def add_commands(app: typer.Typer) -> None:
    """Add the commands that installed packages bring.

    The name of an entry point in the group `servoid.commands` is the command's; it leads to a
    function whose parameters are its options. One that cannot be loaded says so when it is called,
    and no other command suffers; servoid's own are not replaced. They must be there already.
    """
    own = {one.name or one.callback.__name__ for one in app.registered_commands if one.callback}
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(found.items()):
        if name in own:
            continue
        try:
            app.command(name)(entry.load())
        except Exception as error:  # whatever another package does wrong
            _add_refusal(app, name, _unfit(entry, error))
    if _STUDY not in found:
        missing = MissingExtraError(
            "servoid study needs servoid-experiments, which is not installed; install it with: "
            "pip install servoid-experiments"
        )
        _add_refusal(app, _STUDY, missing)


def _unfit(entry: EntryPoint, error: Exception) -> ServoidError:
    """Return what is said of a command whose package does not fit."""
    package = "another package" if entry.dist is None else entry.dist.name
    return ServoidError(
        f"servoid {entry.name} comes from {package}, which does not fit servoid {__version__} "
        f"({error}); install both in the same version"
    )


def _add_refusal(app: typer.Typer, name: str, error: ServoidError) -> None:
    """Add a command that takes anything and raises an error."""

    def refuse(_arguments: Annotated[list[str] | None, typer.Argument()] = None) -> NoReturn:
        raise error

    app.command(name, hidden=True, context_settings=_ANYTHING)(refuse)

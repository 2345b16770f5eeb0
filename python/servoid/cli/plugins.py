"""Adds commands of other packages to `servoid`, which name them as entry points."""

from importlib.metadata import entry_points
from typing import Annotated, NoReturn

import typer

from servoid.errors import MissingExtraError

GROUP = "servoid.commands"
_STUDY = "study"
_ANYTHING = {"ignore_unknown_options": True, "help_option_names": []}


def add_commands(app: typer.Typer) -> None:
    """Add the commands that installed packages bring.

    The name of an entry point in the group `servoid.commands` is the command's; it leads to a
    function whose parameters are its options.
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(found.items()):
        app.command(name)(entry.load())
    if _STUDY not in found:
        app.command(_STUDY, hidden=True, context_settings=_ANYTHING)(_miss_study)


def _miss_study(
    arguments: Annotated[list[str] | None, typer.Argument()] = None,
) -> NoReturn:
    """Say which package brings the command.

    Raises:
        MissingExtraError: always.

    """
    del arguments
    raise MissingExtraError(
        "servoid study needs servoid-experiments, which is not installed; install it with: "
        "pip install servoid-experiments"
    )

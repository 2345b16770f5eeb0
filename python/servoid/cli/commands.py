"""The group of all commands, whose messages are servoid's own."""

from typing import Any

import typer
from typer.core import TyperGroup

from servoid.cli.interrupting import InterruptedCommand
from servoid.cli.option_words import reword


class Commands(TyperGroup):
    """The group of all commands.

    Its library would end an interrupted one without a message, and does not say of a wrong option
    what was given.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run the requested command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            raise InterruptedCommand from interrupt
        except typer.BadParameter as error:
            reword(error)
            raise

"""The group of all commands; its messages are servoid's own, whatever library read an option."""

import re
from typing import Any

import typer
from typer.core import TyperGroup

from servoid.cli.flags import flags_without_type
from servoid.cli.interrupting import InterruptedCommand
from servoid.words import suggestion

_KINDS = {
    "int_parsing": "is not a whole number; write one such as 3",
    "int_parsing_size": "has too many digits; write a smaller number",
    "float_parsing": "is not a number; write one such as 0.5",
}
_BOUNDS = {
    "greater_than_equal": ("ge", "or more"),
    "less_than_equal": ("le", "or less"),
}
_CHOICE = re.compile(r"'(?P<given>[^']*)' is not one of (?P<known>'.+')\.?")
_QUOTED = re.compile(r"'([^']*)'")
_SHOWN = 40  # characters of a value in a message


class Commands(TyperGroup):
    """The group of all commands.

    Its library would end an interrupted one without a message, and does not say of a wrong option
    what was given.
    """

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        with flags_without_type(self.get_params(ctx)):
            super().format_help(ctx, formatter)

    def invoke(self, ctx: Any) -> Any:
        """Run the requested command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            raise InterruptedCommand from interrupt
        except typer.BadParameter as error:
            _reword(error)
            raise


def _reword(error: typer.BadParameter) -> None:
    """Put what was given and what is allowed into the message of a value that no option takes.

    Newer versions of the library that reads the options leave out what was given, and older ones
    what is allowed.
    """
    cause = error.__cause__
    errors = getattr(cause, "errors", None)
    words = None if errors is None else _words(errors()[0])
    if words is not None:
        error.message = words
    choice = _CHOICE.fullmatch(error.message)
    if choice is not None:
        message = error.message.removesuffix(".")
        error.message = message + suggestion(choice["given"], _QUOTED.findall(choice["known"]))


def _words(found: dict[str, Any]) -> str | None:
    kind, context = found["type"], found.get("ctx", {})
    given = str(found["input"])
    shown = given if len(given) <= _SHOWN else f"{given[:_SHOWN]}..."
    if kind in _KINDS:
        return f"'{shown}' {_KINDS[kind]}"
    if kind in _BOUNDS:
        bound, side = _BOUNDS[kind]
        return f"{shown} is out of range; choose {context[bound]} {side}"
    if kind == "value_error" and "error" in context:
        return str(context["error"]).removesuffix(".")
    return None

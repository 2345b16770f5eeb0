"""Writes help pages on which flags have no type, because they take no value."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from typer.core import TyperCommand

from servoid.cli.wrong_options import OptionError

_TYPE = "display_type_rich"  # what newer versions of the library ask an option for


class CommandWithFlags(TyperCommand):
    """A command whose help names no type beside a flag, and whose flags do not contradict."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options.

        Raises:
            OptionError: both flags of a switch are given.

        """
        words = args[: args.index("--")] if "--" in args else args
        for option in self.get_params(ctx):
            sides = (option.opts, option.secondary_opts)
            on, off = (next((word for word in words if word in side), None) for side in sides)
            if on is not None and off is not None:
                raise OptionError(f"{on} and {off} contradict each other; leave one of them out")
        return super().parse_args(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        with flags_without_type(self.get_params(ctx)):
            super().format_help(ctx, formatter)


@contextmanager
def flags_without_type(options: Iterable[Any]) -> Iterator[None]:
    """Let flags among the options of a command have no type inside the block."""
    flags = [one for one in options if getattr(one, "is_flag", False) and hasattr(one, _TYPE)]
    try:
        for flag in flags:
            setattr(flag, _TYPE, _no_type)
        yield
    finally:
        for flag in flags:
            vars(flag).pop(_TYPE, None)


def _no_type(ctx: Any) -> None:
    del ctx  # it is the same in all contexts

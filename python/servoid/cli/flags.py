"""Writes help pages on which flags have no type, because they take no value."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from typer.core import TyperCommand

_TYPE = "display_type_rich"  # what newer versions of the library ask an option for


class CommandWithFlags(TyperCommand):
    """A command whose help names no type beside a flag."""

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

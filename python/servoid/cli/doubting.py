"""Shows the candidates of an ambiguous target, and asks whether to continue."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

import typer

from servoid.cli.messages import print_message
from servoid.errors import DoubtError, TargetError
from servoid.output import write_whole
from servoid.record import draw_answers

_Made = TypeVar("_Made")


class TargetOrder(Protocol):
    """The order of a command: where the result goes, and whether targets are trusted."""

    @property
    def out(self) -> Path:
        """Return the output file."""
        ...

    @property
    def trust_targets(self) -> bool:
        """Return whether to use a target even if it may mean several objects."""
        ...


def settled(work: Callable[[bool], _Made], order: TargetOrder) -> _Made:
    """Call `work` with whether targets are trusted; if one is ambiguous, show it and ask.

    The picture of the candidates is written beside the result. Without a terminal to ask on, the
    target is refused.

    Raises:
        TargetError: a target is ambiguous, and the user does not continue.

    """
    try:
        return work(order.trust_targets)
    except DoubtError as doubt:
        picture = order.out.with_name(f"{order.out.stem}_target.png")
        write_whole(picture, draw_answers(doubt.image, doubt.masks))
        words = f"{doubt}; {picture} shows the candidates"
        if not _can_ask():
            raise TargetError(f"{words}; --trust-targets continues with the first one") from doubt
        print_message(words)
        if not typer.confirm("Continue with the first one?", err=True):
            raise TargetError(f"the target is doubtful; see {picture}") from doubt
    return work(True)


def _can_ask() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()

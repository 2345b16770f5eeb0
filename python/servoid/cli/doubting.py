"""Shows what a doubtful target may mean, and asks whether to go on."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

import typer

from servoid.errors import DoubtError, TargetError
from servoid.output import write_whole
from servoid.record import draw_answers

_Made = TypeVar("_Made")


class Asked(Protocol):
    """What was asked for: where the result goes, and whether targets are trusted."""

    @property
    def out(self) -> Path:
        """Return the file that the result is written to."""
        ...

    @property
    def trust_targets(self) -> bool:
        """Say if a target is used even if it may mean several objects."""
        ...


def settled(work: Callable[[bool], _Made], asked: Asked) -> _Made:
    """Do work that is told if targets are trusted; where one is doubtful, show it and ask.

    The picture of the answers goes beside the result. Where nobody can be asked, nothing is done.

    Raises:
        TargetError: a target is doubtful, and nobody wants to go on.

    """
    try:
        return work(asked.trust_targets)
    except DoubtError as doubt:
        picture = asked.out.with_name(f"{asked.out.stem}_target.png")
        write_whole(picture, draw_answers(doubt.image, doubt.masks))
        words = f"{doubt}; {picture} shows the answers"
        if not _can_ask():
            raise TargetError(f"{words}; --trust-targets goes on with the first one") from doubt
        typer.echo(words, err=True)
        if not typer.confirm("Go on with the first one?", err=True):
            raise TargetError(f"the target is doubtful; see {picture}") from doubt
    return work(True)


def _can_ask() -> bool:
    return sys.stdin.isatty() and sys.stderr.isatty()

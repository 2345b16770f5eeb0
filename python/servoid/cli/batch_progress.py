"""Shows how far a batch is, and what of it is kept when it is interrupted."""

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from servoid.batch import Headway
from servoid.batch.running import Watch
from servoid.cli.interrupting import INTERRUPTED
from servoid.cli.progress import progress_bar
from servoid.words import counted

_MINUTE = 60.0


@contextmanager
def watched_batch(task: str) -> Iterator[Watch]:
    """Show a bar while the block runs a batch with what it gets; Ctrl-C exits with a sentence."""
    last: list[Headway] = []
    try:
        with progress_bar(task) as update:

            def show(headway: Headway) -> None:
                last[:] = [headway]
                update(headway.done / max(1, headway.total), words_of(headway))

            yield show
    except KeyboardInterrupt as interrupt:
        done = f"{last[0].done} of {counted(last[0].total, 'trial')}" if last else "no trials"
        are = "is" if last and last[0].done == 1 else "are"
        typer.echo(
            f"interrupted: {done} {are} done and kept; the same command goes on from there",
            err=True,
        )
        raise typer.Exit(INTERRUPTED) from interrupt


def words_of(headway: Headway) -> str:
    """Say how far a batch is."""
    words = f"{headway.done} of {counted(headway.total, 'trial')}"
    if headway.failed:
        words += f", {headway.failed} failed"
    left = headway.seconds_left
    if left is None or headway.done == headway.total:
        return words
    about = f"{left / _MINUTE:.0f} min" if left >= 1.5 * _MINUTE else f"{left:.0f} s"
    return f"{words}, about {about} left"

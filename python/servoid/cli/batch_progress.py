"""Shows the progress of a batch, and how much of it is kept when it is interrupted."""

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from servoid.batch import BatchProgress, ProgressCallback
from servoid.cli.interrupting import INTERRUPTED
from servoid.cli.progress import progress_bar
from servoid.words import are, counted

_MINUTE = 60.0


@contextmanager
def watched_batch(task: str) -> Iterator[ProgressCallback]:
    """Yield a progress callback and show a bar; on Ctrl-C exit with a message."""
    last: list[BatchProgress] = []
    try:
        with progress_bar(task) as update:

            def show(progress: BatchProgress) -> None:
                last[:] = [progress]
                update(progress.done / max(1, progress.total), words_of(progress))

            yield show
    except KeyboardInterrupt as interrupt:
        done = f"{last[0].done} of {counted(last[0].total, 'trial')}" if last else "no trials"
        count = last[0].done if last else 0
        typer.echo(
            f"interrupted: {done} {are(count)} done and kept; rerun the same command to resume",
            err=True,
        )
        raise typer.Exit(INTERRUPTED) from interrupt


def words_of(progress: BatchProgress) -> str:
    """Describe the progress of a batch."""
    words = f"{progress.done} of {counted(progress.total, 'trial')}"
    if progress.failed:
        words += f", {progress.failed} failed"
    left = progress.seconds_left
    if left is None or progress.done == progress.total:
        return words
    about = f"{left / _MINUTE:.0f} min" if left >= 1.5 * _MINUTE else f"{left:.0f} s"
    return f"{words}, about {about} left"

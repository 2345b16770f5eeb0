"""A progress bar on standard error, for people only."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn


@contextmanager
def progress_bar(task: str) -> Iterator[Callable[[float, str], None]]:
    """Show a bar while the block runs; call what it gives with the share done and a note.

    Nothing is shown where standard error is no terminal.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bar:
        shown = bar.add_task(task, total=1.0, note="")

        def update(share: float, note: str) -> None:
            bar.update(shown, completed=share, note=note)

        yield update

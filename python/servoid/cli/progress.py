"""Shows progress on standard error: a bar on a terminal, lines in logs."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

_LINE_S = 10.0  # interval between lines where a bar cannot be shown

Update = Callable[[float | None, str], None]


@contextmanager
def progress_bar(task: str) -> Iterator[Update]:
    """Show the progress of the block; call the yielded function with the share done and a note.

    The share is None where the end is unknown. If standard error is no terminal, a line is written
    every ten seconds.
    """
    console = Console(stderr=True)
    shown = _bar(task, console) if console.is_terminal else _lines(task, console)
    with shown as update:
        yield update


@contextmanager
def _bar(task: str, console: Console) -> Iterator[Update]:
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with bar:
        shown = bar.add_task(task, total=1.0, note="")

        def update(share: float | None, note: str) -> None:
            bar.update(shown, completed=share, total=None if share is None else 1.0, note=note)

        yield update


@contextmanager
def _lines(task: str, console: Console) -> Iterator[Update]:
    """Write lines at fixed intervals, because updates may not come for a while."""
    latest: list[tuple[float | None, str]] = [(0.0, "")]
    over = threading.Event()

    def report() -> None:
        seconds = 0.0
        while not over.wait(_LINE_S):
            seconds += _LINE_S
            share, note = latest[0]
            far = "" if share is None else f"{100.0 * share:.0f} % after "
            done = f"{task}: {far}{seconds:.0f} s"
            line = f"{done}, {note}" if note else done
            console.file.write(f"{line}\n")
            console.file.flush()

    def update(share: float | None, note: str) -> None:
        latest[0] = (share, note)

    reporter = threading.Thread(target=report, name="progress", daemon=True)
    reporter.start()
    try:
        yield update
    finally:
        over.set()
        reporter.join()

"""Runs the core in a thread, reports its progress to the caller, and lets the caller stop it."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from queue import SimpleQueue
from threading import Event
from typing import TypeVar

from servoid._native import Step

ItemT = TypeVar("ItemT")
MadeT = TypeVar("MadeT")


@dataclass(frozen=True)
class Progress:
    """The progress of modelling: ellipsoids so far, their fitness, the share done, the stage."""

    count: int
    fitness: float
    share: float
    stage: str = "modelling"


ProgressCallback = Callable[[Progress], None]


def part_of(report: ProgressCallback | None, first: float, last: float) -> ProgressCallback | None:
    """Return what reports a part of the work, from its first to its last share of the whole."""
    if report is None:
        return None
    return lambda part: report(replace(part, share=first + (last - first) * part.share))


class _StoppedError(Exception):
    """Stops the core's work from its callback."""


def run_core(
    fit: Callable[[Callable[[int, float, float], None]], list[Step]],
    progress: ProgressCallback | None,
) -> list[Step]:
    """Run `fit`, which takes the core's progress callback; call `progress` on the caller's thread.

    An exception in `progress`, or Ctrl-C, stops the core at its next report and propagates from
    here: the core's own threads cannot receive a signal.
    """
    news: SimpleQueue[Progress | None] = SimpleQueue()
    stop = Event()

    def report(count: int, fitness: float, share: float) -> None:
        if stop.is_set():
            raise _StoppedError
        news.put(Progress(count, fitness, share))

    def work() -> list[Step]:
        try:
            return fit(report)
        finally:
            news.put(None)

    with ThreadPoolExecutor(max_workers=1) as pool:
        steps = pool.submit(work)
        try:
            while (update := news.get()) is not None:
                if progress is not None:
                    progress(update)
        except BaseException:
            stop.set()
            raise
    return steps.result()


def in_parallel(work: Callable[[ItemT], MadeT], items: Iterable[ItemT]) -> list[MadeT]:
    """Process several items in parallel; return the results in their order."""
    # Decoding and GrabCut release Python's lock: two threads halve the time on two cores.
    with ThreadPoolExecutor(max_workers=min(8, os.cpu_count() or 1)) as pool:
        return list(pool.map(work, items))

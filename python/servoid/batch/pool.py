"""Processes for trials that end when they are no longer wanted."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, Protocol

Submit = Callable[..., Future[Any]]


class Held(Protocol):
    """The end of a pipe that hears when nobody holds the other end any more."""

    def poll(self, timeout: float | None, /) -> bool:
        """Wait for that."""
        ...


@contextmanager
def process_pool(count: int) -> Iterator[Submit]:
    """Start `count` processes, each on one core; the block gives them work by what it gets.

    If the block is broken off they end at once, whatever they do; so they do if this process dies.
    """
    context = get_context("spawn")
    held, hold = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(held,))

    def submit(function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with _no_interrupt():  # a process may be started for it
            return pool.submit(function, *arguments)

    try:
        yield submit
        pool.shutdown()
    finally:
        hold.close()
        pool.shutdown(cancel_futures=True)
        held.close()


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Let processes that are started within never hear of Ctrl-C; this process hears it after."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    with _put_off():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _put_off() -> Iterator[None]:
    """Put a Ctrl-C off until the block ends, also one that another thread takes in."""
    if threading.current_thread() is not threading.main_thread():
        yield  # where Python never interrupts
        return
    came: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if came:
            signal.raise_signal(signal.SIGINT)


def _begin(held: Held) -> None:
    """Prepare a trial's process: it has one core, as there are as many processes as cores."""
    threading.Thread(target=_end_with, args=(held,), daemon=True).start()
    # Read when the first threads start, which is after this.
    os.environ["RAYON_NUM_THREADS"] = "1"
    import cv2

    cv2.setNumThreads(1)


def _end_with(held: Held) -> None:
    """End this process when nobody holds the other end of the pipe."""
    held.poll(None)
    os._exit(1)

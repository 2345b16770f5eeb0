"""Processes for trials, which end when they are no longer needed."""

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
    """The read end of a pipe, which becomes readable when the other end is closed."""

    def poll(self, timeout: float | None, /) -> bool:
        """Wait until the other end is closed."""
        ...


@contextmanager
def process_pool(count: int) -> Iterator[Submit]:
    """Start `count` processes, each on one core; yields the function that submits work to them.

    If the block is interrupted, or if this process dies, they end at once, whatever they are doing.
    """
    context = get_context("spawn")
    held, hold = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, context, initializer=_begin, initargs=(held,))

    def submit(function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with _no_interrupt():  # submitting may start a process
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
    """Start child processes that ignore Ctrl-C; this process handles it when the block ends."""
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
    """Delay Ctrl-C until the block ends, also where another thread receives it."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python never interrupts such a thread
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
    """Prepare a trial's process: it uses one core, as there are as many processes as cores."""
    threading.Thread(target=_end_with, args=(held,), daemon=True).start()
    # The core reads this when it starts its first threads, which is later.
    os.environ["RAYON_NUM_THREADS"] = "1"
    import cv2

    cv2.setNumThreads(1)


def _end_with(held: Held) -> None:
    """End this process when the other end of the pipe is closed."""
    held.poll(None)
    os._exit(1)

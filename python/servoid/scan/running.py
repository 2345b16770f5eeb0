"""Runs pycolmap in a thread: it can be stopped, prints nothing, and its seed is fixed."""

import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYet
from types import ModuleType
from typing import Any, TypeVar

from servoid.errors import MissingExtraError

_LOOK_S = 0.1  # period at which the caller may stop the work
MadeT = TypeVar("MadeT")


def pycolmap() -> ModuleType:
    """Return the library that estimates poses, with its output turned off.

    Raises:
        MissingExtraError: it is not installed.

    """
    is_new = "pycolmap" not in sys.modules
    try:
        import pycolmap as library
    except ImportError as error:
        raise MissingExtraError.of("scans", "pycolmap", "scan") from error
    library.logging.minloglevel = library.logging.FATAL.value
    if is_new and threading.current_thread() is threading.main_thread():
        # The library's own handler would end the process with a stack trace.
        signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGTERM) or signal.SIG_DFL)
    return library


def run(work: Callable[[Any], MadeT], while_waiting: Callable[[], None] | None = None) -> MadeT:
    """Run `work`, which takes a token for pycolmap, in a thread; Ctrl-C stops it and propagates.

    `while_waiting` is called regularly on the caller's thread; an exception in it stops the work.
    """
    token = pycolmap().CancellationToken()
    with ThreadPoolExecutor(max_workers=1) as pool:
        running = pool.submit(work, token)
        try:
            while True:
                try:
                    return running.result(timeout=_LOOK_S)
                except NotYet:
                    if running.done():
                        raise
                    if while_waiting is not None:
                        while_waiting()
        except BaseException:
            token.cancel()
            raise

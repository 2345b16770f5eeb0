"""Makes Ctrl-C, SIGTERM and SIGHUP end a command cleanly: no partial files, one message."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
_AFTER_SIGNAL = 128  # shells and service managers expect this plus the signal's number
_ENDING = ("SIGTERM", "SIGHUP")  # the latter, of a terminal that closes, is unknown to Windows


class InterruptedCommand(BaseException):
    """Is raised for Ctrl-C in a command that prints no message of its own."""


@contextmanager
def heeded_signals() -> Iterator[list[int]]:
    """Let Ctrl-C, SIGTERM and SIGHUP interrupt the block, and yield the list of received signals.

    Ctrl-C does so even where a shell started this process in the background, ignoring it. A SIGHUP
    that is ignored, as under nohup, stays ignored.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came  # where Python interrupts no code
        return
    deaf = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    if deaf:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    home = os.getpid()

    def heed(number: int, _: FrameType | None) -> None:
        if os.getpid() != home:  # a forked process keeps the default behaviour
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        came.append(number)
        signal.raise_signal(signal.SIGINT)

    before = {number: signal.signal(number, heed) for number in _heedable()}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
        if deaf:
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def exit_code(came: list[int]) -> int:
    """Return the exit code of an interrupted command that received some signals."""
    return _AFTER_SIGNAL + came[0] if came else INTERRUPTED


def _heedable() -> list[int]:
    """Return the signals that end this process."""
    numbers = [getattr(signal, name) for name in _ENDING if hasattr(signal, name)]
    hangup = getattr(signal, "SIGHUP", None)
    return [n for n in numbers if n != hangup or signal.getsignal(n) is not signal.SIG_IGN]

"""Makes Ctrl-C and SIGTERM end a command cleanly: no partial files, and one message."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from typer.core import TyperGroup

INTERRUPTED = 130
TERMINATED = 143  # the exit code that shells and service managers expect after SIGTERM


class InterruptedCommand(BaseException):
    """Is raised for Ctrl-C in a command that prints no message of its own."""


class Commands(TyperGroup):
    """The group of all commands; its library would end an interrupted one without a message."""

    def invoke(self, ctx: Any) -> Any:
        """Run the requested command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as interrupt:
            raise InterruptedCommand from interrupt


@contextmanager
def heeded_signals() -> Iterator[list[int]]:
    """Let Ctrl-C and SIGTERM interrupt the block, and yield the list of received signals.

    Ctrl-C does so even where a shell started this process in the background, ignoring it.
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

    before = signal.signal(signal.SIGTERM, heed)
    try:
        yield came
    finally:
        signal.signal(signal.SIGTERM, before or signal.SIG_DFL)
        if deaf:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

"""Runs the command line and turns every failure into one clear line and an exit code."""

import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from typing import NoReturn

from servoid.errors import ServoidError

FAILED = 1
BUG = 70  # what <sysexits.h> calls an internal software error
INTERRUPTED = 130

_SHOW_TRACEBACK = "SERVOID_TRACEBACK"


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `servoid ARGUMENTS` and exit: 0 done, 1 failed, 2 wrong usage, 130 interrupted."""
    # The decoders write to standard error by themselves; servoid says what is wrong with a file.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    _heed_interrupts()
    try:
        from servoid.cli.app import app

        app(args=arguments, prog_name="servoid")
    except ServoidError as error:
        _fail(f"error: {error}", FAILED)
    except KeyboardInterrupt:
        _fail("interrupted; nothing was written", INTERRUPTED)
    except Exception as error:
        _fail(_bug(error), BUG)
    except BaseException as error:
        # A panic of the core is no Exception; an exit is no failure.
        if isinstance(error, (SystemExit, GeneratorExit)):
            raise
        _fail(_bug(error), BUG)
    sys.exit(0)


def _heed_interrupts() -> None:
    """Let Ctrl-C interrupt, also where a shell started this in the background, deaf to it."""
    main_thread = threading.current_thread() is threading.main_thread()
    if main_thread and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _bug(error: BaseException) -> str:
    what = f"{type(error).__name__}: {error}".replace("\n", " ")
    return (
        f"error: this is a bug in servoid, please report it: {what} "
        f"({_SHOW_TRACEBACK}=1 shows where)"
    )


def _fail(message: str, code: int) -> NoReturn:
    if os.environ.get(_SHOW_TRACEBACK) == "1":
        traceback.print_exc()
    sys.stderr.write(message + "\n")
    sys.exit(code)

"""Runs the command line and turns every failure into one line and an exit code."""

import errno
import logging
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from servoid.cli.interrupting import (
    INTERRUPTED,
    InterruptedCommand,
    exit_code,
    heeded_signals,
)
from servoid.cli.messages import print_message
from servoid.cli.wrong_options import OptionError
from servoid.errors import ServoidError
from servoid.output import noted_writes
from servoid.words import reason_of

FAILED = 1
WRONG_OPTION = 2
BUG = 70  # an internal software error in <sysexits.h>

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NAMED = 6  # of what was written, in a message
_SHOWN = 60  # letters of a path that is too long
_SHOW_TRACEBACK = "SERVOID_TRACEBACK"
_NO_MEMORY = (
    "error: out of memory; end other programs, raise the memory limit of this process, or give "
    "fewer or smaller images and meshes"
)


def program() -> NoReturn:
    """Run the words of the command line as a process of its own, as `main` does.

    An interrupted process still waits for its threads: another Ctrl-C ends it at once.
    """
    try:
        main()
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `servoid ARGUMENTS` and exit: 0 done, 1 failed, 2 wrong usage, 130 interrupted."""
    _quieten()
    with heeded_signals() as came, noted_writes() as written:
        try:
            _run(arguments, written)
        except SystemExit as end:
            if end.code == INTERRUPTED:
                sys.exit(exit_code(came))
            raise


def _quieten() -> None:
    """Keep libraries from writing to standard error: servoid reports the errors of a file."""
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    # It warns if the home folder is not writable, which plots do not need.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _run(arguments: Sequence[str] | None, written: Sequence[Path]) -> NoReturn:
    try:
        from servoid.cli.app import app

        app(args=arguments, prog_name="servoid")
    except OptionError as error:
        _fail(f"error: {error}", WRONG_OPTION)
    except ServoidError as error:
        _fail(f"error: {error}", FAILED)
    except (KeyboardInterrupt, InterruptedCommand):
        _fail(f"interrupted; {_what_was_written(written)}", INTERRUPTED)
    except MemoryError:
        _fail(_NO_MEMORY, FAILED)
    except OSError as error:
        if _is_of_printing(error):
            _fail(_unprinted(error), FAILED)
        if error.errno == errno.ENAMETOOLONG and error.filename is not None:
            # Asking whether there is such a file fails already, in many places.
            _fail(_too_long(error), FAILED)
        _fail(_bug(error), BUG)
    except Exception as error:
        _fail(_bug(error), BUG)
    except BaseException as error:
        # A panic of the core is not an Exception; an exit is not a failure.
        if isinstance(error, (SystemExit, GeneratorExit)):
            raise
        _fail(_bug(error), BUG)
    sys.exit(0)


def _what_was_written(written: Sequence[Path]) -> str:
    """Name what a command wrote that is still there."""
    there = list(dict.fromkeys(path for path in written if path.exists()))
    if not there:
        return "nothing was written"
    more = f" and {len(there) - _NAMED} more" if len(there) > _NAMED else ""
    return f"written before: {', '.join(map(str, there[:_NAMED]))}{more}"


def _is_of_printing(error: OSError) -> bool:
    """Return whether the text of a command cannot be written to standard output.

    A file that cannot be written is reported where it is written, as an OutputError.
    """
    return error.errno in _NO_ROOM and error.filename is None


def _unprinted(error: OSError) -> str:
    return (
        f"error: cannot write to standard output: {reason_of(error)}; make room there, or redirect "
        "the output to another place"
    )


def _too_long(error: OSError) -> str:
    name = str(error.filename)
    return f"error: cannot use {name[:_SHOWN]}...: {reason_of(error)}; choose a shorter name"


def _bug(error: BaseException) -> str:
    what = f"{type(error).__name__}: {error}".replace("\n", " ")
    return (
        f"error: this is a bug in servoid, please report it: {what} "
        f"({_SHOW_TRACEBACK}=1 shows where)"
    )


def _fail(message: str, code: int) -> NoReturn:
    if os.environ.get(_SHOW_TRACEBACK) == "1":
        traceback.print_exc()
    print_message(message)
    sys.exit(code)

"""Prints messages on standard error: in whole words on a terminal, in one line elsewhere."""

import os
import re
import sys
import textwrap

_USUAL = 80  # columns of a terminal that does not tell
_NARROWEST = 20  # columns of a terminal for which wrapping makes sense
_IN_COMMANDS = "\ue000"  # of no text: where no line may break
# A command to copy follows `with: ` or `such as: `, or writes to --out.
_COMMAND = re.compile(
    r"(?:(?<=with: )|(?<=such as: ))(?:[^;, (]|,(?! )| (?!\())+|\bservoid \w+ \S+ --out [^\s;]+"
)


def print_message(message: str) -> None:
    """Print a message on standard error, which is one line of a pipe or a file."""
    if sys.stderr.isatty():
        message = in_lines(message, _columns())
    sys.stderr.write(message + "\n")


def _columns() -> int:
    """Return the width of the terminal on which messages appear."""
    try:
        return int(os.environ.get("COLUMNS", "")) or _USUAL
    except ValueError:
        pass
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or _USUAL
    except OSError:
        return _USUAL


def in_lines(message: str, columns: int) -> str:
    """Break a message into lines of so many columns, between words.

    Longer words, such as paths without spaces, and commands to copy stay whole: a terminal shows
    them in several rows, and copies them as one line.
    """
    if columns < _NARROWEST:
        return message
    joined = _COMMAND.sub(lambda command: command[0].replace(" ", _IN_COMMANDS), message)
    lines = textwrap.wrap(joined, columns, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace(_IN_COMMANDS, " ")

"""Prints messages on standard error: in whole words on a terminal, in one line elsewhere."""

import re
import shutil
import sys
import textwrap

_NARROWEST = 20  # columns of a terminal for which wrapping makes sense
_IN_COMMANDS = "\N{NO-BREAK SPACE}"  # where no line may break
# A command to copy follows `with: ` or `such as: `, or writes to --out.
_COMMAND = re.compile(
    r"(?<=: )(?<=with: |h as: )(?:[^;, (]|,(?! )| (?!\())+|\bservoid \w+ \S+ --out [^\s;]+"
)


def print_message(message: str) -> None:
    """Print a message on standard error, which is one line of a pipe or a file."""
    if sys.stderr.isatty():
        message = in_lines(message, shutil.get_terminal_size().columns)
    sys.stderr.write(message + "\n")


def in_lines(message: str, columns: int) -> str:
    """Break a message into lines of so many columns, between words.

    Longer words, such as paths, and commands to copy stay whole: a terminal shows them in several
    rows, and copies them as one line.
    """
    if columns < _NARROWEST:
        return message
    joined = _COMMAND.sub(lambda command: command[0].replace(" ", _IN_COMMANDS), message)
    lines = textwrap.wrap(joined, columns, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace(_IN_COMMANDS, " ")

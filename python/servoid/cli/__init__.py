"""The command line: the only part that prints or exits."""

from servoid.cli.entry import main, program

__all__ = ["main", "program"]

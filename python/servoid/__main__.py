"""`python -m servoid`, the same as `servoid`."""

from servoid.cli import program

program()

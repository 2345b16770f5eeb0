"""Asks a person in the browser which object is meant: a page on this machine alone."""

from servoid.pick.asking import Choice, Question
from servoid.pick.server import PickServer

__all__ = ["Choice", "PickServer", "Question"]

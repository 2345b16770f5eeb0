"""Asks the user in the browser which object is meant, with a local page."""

from servoid.pick.asking import Choice, Mark, Question
from servoid.pick.server import PickServer

__all__ = ["Choice", "PickServer", "Question"]

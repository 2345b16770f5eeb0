"""Checks the unit in which the lengths of a file of another program are given."""

import math
from pathlib import Path
from typing import TypeVar

from servoid.errors import ServoidError
from servoid.words import digits

_ErrorT = TypeVar("_ErrorT", bound=ServoidError)


def check_unit(path: Path, unit_m: float, error: type[_ErrorT]) -> None:
    """Raise an `error` if a unit of lengths is not a positive number of metres."""
    if not 0.0 < unit_m < math.inf:
        raise error(
            f"the unit of {path} is given as {digits(unit_m)} m; give the metres of one unit of "
            "its lengths, a positive number, or 1 if they are in metres"
        )

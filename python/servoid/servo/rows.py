"""Reads rows of numbers that describe joints, and checks that their limits can be true."""

from collections.abc import Sequence

import numpy as np

from servoid.config import TURN, TURN_SPEED, implausible
from servoid.errors import ServoError
from servoid.pose import Floats
from servoid.words import counted, digits

_REAL = "fiuO"  # kinds of arrays of real numbers, or of objects that may be such


def is_number(given: object) -> bool:
    """Return whether a value is a real number; NaN is one."""
    return isinstance(given, int | float | np.integer | np.floating)


def is_index(given: object) -> bool:
    """Return whether a value is a whole number."""
    return isinstance(given, int | np.integer) and not isinstance(given, bool)


def row_of(what: str, given: object, count: int | None = None) -> Floats:
    """Convert a row of numbers, and check its length if `count` is given.

    Raises:
        ServoError: it is no row of real numbers, or is longer or shorter.

    """
    if np.ma.is_masked(given):
        raise ServoError(
            f"{what} holds masked values; where a sensor has none, give NaN, which holds the hand"
        )
    try:
        raw = np.asarray(given)
        if raw.dtype.kind not in _REAL:
            raise TypeError(f"its type is {raw.dtype}")
        numbers = np.asarray(raw, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ServoError(f"{what} must be a row of numbers, but is {given!r:.60}") from error
    if numbers.ndim != 1 or count not in (None, len(numbers)):
        expected = (
            "a row of numbers"
            if count is None
            else f"{counted(count, 'number')}, one for each name"
        )
        raise ServoError(f"{what} must be {expected}, but has shape {numbers.shape}")
    return numbers


def check_range(names: Sequence[str], lower: Floats, upper: Floats) -> None:
    """Check the limits of joints' angles, in radians; a joint without an end has infinite ones.

    Raises:
        ServoError: a lower limit is not below the upper one, or one is as if in degrees.

    """
    for name, least, most in zip(names, lower, upper, strict=True):
        # The exchange shows in any unit, and NaN is below nothing.
        if not least < most:
            raise ServoError(
                f"joint '{name}' has the lower limit {digits(least)} and the upper limit "
                f"{digits(most)}; the lower one must be below the upper one: are they exchanged?"
            )
        for side, limit in (("lower", least), ("upper", most)):
            absurd = implausible(f"Joints.{side} of joint '{name}'", limit, TURN, "rad")
            if absurd is not None:
                raise ServoError(f"{absurd}; if it turns without an end, give -inf and inf")


def check_rates(names: Sequence[str], what: str, values: Floats) -> None:
    """Check limits of joints' `speed`, `acceleration` or `jerk`.

    Raises:
        ServoError: one cannot be true, or a speed is as if in degrees per second.

    """
    for name, value in zip(names, values, strict=True):
        given = f"Joints.{what} of joint '{name}'"
        if what == "acceleration" and np.isinf(value):
            raise ServoError(
                f"{given} is {digits(value)}; give the finite number of its data sheet"
            )
        least = 0.0 if what == "speed" else np.nextafter(0.0, 1.0)
        if not value >= least:
            allowed = "0 or more" if what == "speed" else "a number above 0"
            raise ServoError(f"{given} must be {allowed}, but is {digits(value)}")
        absurd = implausible(given, value, TURN_SPEED, "rad/s") if what == "speed" else None
        if absurd is not None:
            raise ServoError(absurd)

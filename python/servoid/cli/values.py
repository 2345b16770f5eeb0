"""Checks the values of options."""

import math
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

import typer

from servoid._native import ModelSettings
from servoid.errors import ServoidError
from servoid.words import number_of

_LARGEST_SEED = 2**64 - 1
_LARGEST_COUNT = 2**31 - 1


class Method(str, Enum):
    """How to model or to track."""

    region = "region"
    paper = "paper"


class Triple(NamedTuple):
    """Three numbers of one option."""

    x: float
    y: float
    z: float


class Size(str, Enum):
    """The image size of a moving sample."""

    small = "small"
    full = "full"


def triple_parser(option: str) -> Callable[[str], Triple]:
    """Return a function that parses the `0.1,0,-0.5` of an option as three numbers."""

    def parse(text: str) -> Triple:
        try:
            numbers = [number_of(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
            raise typer.BadParameter(
                f"'{text}' is not X,Y,Z; write three numbers, such as 0,0,-0.5", param_hint=option
            )
        return Triple(*numbers)

    return parse


def slice_parser(option: str) -> Callable[[str], slice]:
    """Return a function that parses `0:16:2`, any part of which may be left out, as a slice."""

    def parse(text: str) -> slice:
        parts = text.split(":")
        try:
            numbers = [int(part) if part.strip() else None for part in parts]
        except ValueError:
            numbers = []
        if len(numbers) not in (2, 3) or numbers[2:] == [0]:
            raise typer.BadParameter(
                f"'{text}' is not a range; write START:STOP:STEP with whole numbers, any of "
                "which may be left out, and a STEP that is not 0, such as '::2' or '0:16:2'",
                param_hint=option,
            )
        return slice(*numbers)

    return parse


def check_seed(seed: int | None) -> int | None:
    """Return the seed if it is in the core's range."""
    if seed is not None and not 0 <= seed <= _LARGEST_SEED:
        raise typer.BadParameter(f"{seed} is not a seed; choose one from 0 to {_LARGEST_SEED}")
    return seed


def check_count(count: int | None) -> int | None:
    """Return a count if it is in range."""
    if count is not None and not _is_count(count):
        raise typer.BadParameter(f"{count} is out of range; choose 1 to {_LARGEST_COUNT}")
    return count


def checked_by(settings: Callable[..., object], name: str) -> Callable[[int | None], int | None]:
    """Return a callback that refuses an invalid count with the core's error message.

    The core's settings define the range, and refuse other counts when they are constructed.
    """

    def check(number: int | None) -> int | None:
        if number is not None and not _is_count(number):
            try:
                settings(**{name: number})
            except ServoidError as error:  # which names the setting, not the option
                message = str(error).replace(f"{name} must", "it must", 1)
                raise typer.BadParameter(message) from error
        return number

    return check


def check_threads(count: int | None) -> int | None:
    """Return a number of threads, or of processes, if it is in range."""
    most = ModelSettings.MAX_THREADS
    if count is not None and not 1 <= count <= most:
        raise typer.BadParameter(f"{count} is out of range; choose 1 to {most}")
    return count


def _is_count(number: int) -> bool:
    return 1 <= number <= _LARGEST_COUNT

"""Small experiments to run in batches; other processes import them from here."""

import os
import random
import time
from enum import Enum
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from servoid.batch import Experiment
from servoid.errors import ModelError


class Kind(Enum):
    SMALL = "small"
    LARGE = "large"


class Inner(msgspec.Struct, frozen=True):
    gain: Annotated[float, Meta(description="of a loop, 1/s")] = 1.5
    name: str | None = None


class Case(msgspec.Struct, frozen=True):
    seed: int
    inner: Inner = Inner()
    kind: Kind = Kind.SMALL
    place: tuple[float, float, float] = (0.0, 0.0, 1.0)
    folder: str | None = None


class Row(msgspec.Struct, frozen=True):
    value: float
    course: list[float]
    by_name: dict[str, int]
    open: float | None = None


def draw(case: Case) -> Row:
    """Return numbers that depend on the case alone; say in a folder that it was run."""
    if case.folder is not None:
        with (Path(case.folder) / str(case.seed)).open("a") as file:
            file.write("x")
    if case.seed == 3:
        raise ModelError("seed 3 cannot be modelled; choose another")
    source = random.Random(case.seed)
    values = [source.gauss(0.0, case.inner.gain) for _ in range(5)]
    return Row(sum(values), values, {case.kind.value: case.seed}, None if case.seed % 2 else 0.5)


def stumble(case: Case) -> Row:
    """Do as `draw`, but for a seed that kills its process, and one that has a bug."""
    if case.seed == 4:
        os._exit(9)
    if case.seed == 5:
        raise IndexError("out of range")
    return draw(case)


def no_number(case: Case) -> Row:
    return Row(float("nan"), [], {"seed": case.seed})


def dawdle(case: Case) -> Row:
    """Do as `draw`, slowly, and tell which process does it."""
    if case.folder is not None:
        (Path(case.folder) / f"{case.seed}.{os.getpid()}").touch()
    time.sleep(0.3)
    return draw(Case(case.seed, case.inner))


def linger(case: Case) -> Row:
    """Say in a folder that it was begun, and then take far longer than anybody waits."""
    (Path(case.folder or "") / str(case.seed)).touch()
    time.sleep(600.0)
    return draw(Case(case.seed))


DRAW = Experiment("draw", draw, Case, Row)
STUMBLE = Experiment("stumble", stumble, Case, Row)
NO_NUMBER = Experiment("no_number", no_number, Case, Row)
DAWDLE = Experiment("dawdle", dawdle, Case, Row)
LINGER = Experiment("linger", linger, Case, Row)

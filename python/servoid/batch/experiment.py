"""What a batch runs, pure functions from a case to a row of results, and what it returns."""

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import msgspec

from servoid._native import __version__
from servoid.brief import brief
from servoid.errors import StudyError

_NAME = re.compile(r"[a-z][a-z0-9_.]*")

CaseT = TypeVar("CaseT", bound=msgspec.Struct)
RowT = TypeVar("RowT", bound=msgspec.Struct)


@dataclass(frozen=True)
class Experiment(Generic[CaseT, RowT]):
    """A kind of trial.

    `run` is a function at the top level of a module. Its case contains everything that affects the
    result, including the seed, so that the same case gives the same row on any machine, in any
    order. Cases and rows are frozen msgspec structs of numbers, strings, booleans, and lists or
    structs of these. Increase `version` when the same case no longer gives the same row: results of
    an older version, or of another version of servoid, are not reused.
    """

    name: str
    run: Callable[[CaseT], RowT]
    case: type[CaseT]
    row: type[RowT]
    version: int = 1

    def __post_init__(self) -> None:
        """Check that its tables can be named, and that other processes can import the function.

        Raises:
            StudyError: the name is not a plain word, or the function is defined inside another one.

        """
        if not _NAME.fullmatch(self.name):
            raise StudyError(
                f"'{self.name}' cannot name an experiment; use lowercase letters, digits, _ and ."
            )
        if "<" in self.run.__qualname__:
            raise StudyError(
                f"the experiment '{self.name}' runs {self.run.__qualname__}, which no other "
                "process can import; define it at the top level of a module"
            )

    def key(self, case: CaseT) -> str:
        """Return a name for a case that is unique among the cases of all experiments."""
        about = [__version__, self.name, self.version, msgspec.to_builtins(case)]
        content = msgspec.json.encode(about)
        return hashlib.sha256(content).hexdigest()[:24]


@dataclass(frozen=True)
class Work:
    """An experiment and the cases to run it on."""

    experiment: Experiment[Any, Any]
    cases: Sequence[Any]

    __repr__ = brief


@dataclass(frozen=True)
class Done:
    """A finished trial: its row, or else a message that gives the reason for its failure."""

    case: Any
    row: Any | None
    failure: str = ""


Results = Mapping[str, Sequence[Done]]
"""The finished trials by the experiment's name, in the order of the cases."""

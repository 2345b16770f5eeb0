"""What is to be tried, and what came of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from servoid.batch.experiment import Experiment


@dataclass(frozen=True)
class Work:
    """An experiment and the cases that it is to be run for."""

    experiment: Experiment[Any, Any]
    cases: Sequence[Any]


@dataclass(frozen=True)
class Done:
    """A trial that was run: its row, or else what went wrong, as a sentence."""

    case: Any
    row: Any | None
    failure: str = ""


Results = Mapping[str, Sequence[Done]]
"""What came of the trials, by the experiment's name, in the order of the cases."""

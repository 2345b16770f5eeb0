"""The trials to run, and their results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from servoid.batch.experiment import Experiment


@dataclass(frozen=True)
class Work:
    """An experiment and the cases to run it on."""

    experiment: Experiment[Any, Any]
    cases: Sequence[Any]


@dataclass(frozen=True)
class Done:
    """A finished trial: its row, or else a message that gives the reason for its failure."""

    case: Any
    row: Any | None
    failure: str = ""


Results = Mapping[str, Sequence[Done]]
"""The finished trials by the experiment's name, in the order of the cases."""

"""The definition of a study: settings, the trials that they require, and the report."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from servoid.batch import Done, Results, Work
from servoid_experiments.report import Section

__all__ = ["Done", "Results", "Study", "Work"]

SettingsT = TypeVar("SettingsT", bound=msgspec.Struct)


@dataclass(frozen=True)
class Study(Generic[SettingsT]):
    """A question that is answered by trials.

    `settings` is a frozen msgspec struct whose defaults are the whole study; `quick` are settings
    of a small one that takes seconds. `plan` returns the trials for settings. `report` draws
    figures into a folder and returns the sections of the study's page, whose tables are its data;
    it omits failed trials, which have no row.
    """

    name: str
    title: str
    question: str
    settings: type[SettingsT]
    quick: SettingsT
    plan: Callable[[SettingsT], Sequence[Work]]
    report: Callable[[SettingsT, Results, Path], Sequence[Section]]

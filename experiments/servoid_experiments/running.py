"""Runs a study: its trials, its figures and its page."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec

from servoid.batch import Results, Workers, run_batch
from servoid.batch.running import ProgressCallback
from servoid.config.strict import read_toml
from servoid.errors import StudyError
from servoid.output import make_folder, write_together, write_whole
from servoid.servo import settings_toml
from servoid.words import alternatives
from servoid_experiments.design import Section, Study, Table
from servoid_experiments.page import write_study_page

STUDIES = {
    "paper": ("servoid_experiments.paper.study", "PAPER"),
    "bode": ("servoid_experiments.bode.report", "BODE"),
    "track": ("servoid_experiments.tracking.study", "TRACK"),
    "model": ("servoid_experiments.modelling.study", "MODEL"),
}
_SETTINGS = "study.toml"
_MOST_FAILURES = 3  # listed in full


@dataclass(frozen=True)
class StudyReport:
    """The results of a study: its sections, its page, its trials, and the reasons of failures.

    `quick` says that the study is a quick one; None otherwise.
    """

    sections: tuple[Section, ...]
    page: Path
    trials: int
    failures: tuple[str, ...]
    quick: str | None = None


def study_named(name: str) -> Study[Any]:
    """Return a study by its name.

    Raises:
        StudyError: there is none of this name.

    """
    if name not in STUDIES:
        raise StudyError(f"there is no study '{name}'{alternatives(name, STUDIES)}")
    module, constant = STUDIES[name]
    return getattr(import_module(module), constant)


def read_study_settings(study: Study[Any], path: str | Path) -> msgspec.Struct:
    """Read the settings of a study from a TOML file; missing keys keep their defaults.

    Raises:
        StudyError: the file cannot be read, a key is unknown, or a value is invalid.

    """
    return read_toml(Path(path), study.settings, StudyError)


def run_study(
    study: Study[Any],
    settings: msgspec.Struct,
    folder: str | Path,
    *,
    workers: Workers | None = None,
    watch: ProgressCallback | None = None,
) -> StudyReport:
    """Run the trials of a study that are not done yet, and write its page, figures and tables.

    Raises:
        StudyError: the settings are invalid, or the workers cannot run anything.
        MissingExtraError: a library is not installed.
        OutputError: the folder, or the one above it, cannot be written.

    """
    place = Path(folder)
    make_folder(place)
    text = settings_toml(settings)
    write_whole(place / _SETTINGS, text.encode())
    results = run_batch(study.plan(settings), place, workers, watch)
    sections = tuple(study.report(settings, results))
    write_together(_files(sections, place))
    failures, quick = _failures(results), quick_note(study, settings)
    page = write_study_page(
        place,
        study.title,
        sections,
        question=study.question,
        settings=text,
        notes=[*([] if quick is None else [f"{quick}."]), *_notes(failures)],
    )
    return StudyReport(sections, page, sum(map(len, results.values())), failures, quick)


def quick_note(study: Study[Any], settings: msgspec.Struct) -> str | None:
    """Report that settings are those of a quick study, and how small it is; None if they are not.

    A study whose quick settings are all of it has none.
    """
    whole = study.settings()
    if settings != study.quick or settings == whole:
        return None
    few, all_of_them = (
        sum(len(work.cases) for work in study.plan(one)) for one in (settings, whole)
    )
    return (
        f"This is a quick study, of {few} trials where the whole one has {all_of_them}: its "
        "figures are rough"
    )


def _files(sections: Sequence[Section], folder: Path) -> dict[Path, bytes]:
    """Return the pictures, their numbers, the tables, and the verdicts if there are any."""
    pictures = [one for part in sections for one in part.pictures]
    tables = [one.numbers for one in pictures if one.numbers is not None]
    tables += [one for part in sections for one in part.tables]
    verdicts = [
        (part.heading, claim, verdict.value)
        for part in sections
        for claim, verdict in part.findings.items()
    ]
    if verdicts:
        tables.append(Table("verdicts", ("section", "claim", "verdict"), verdicts))
    return {
        **{folder / f"{one.name}.png": one.png for one in pictures},
        **{folder / f"{one.name}.csv": one.csv() for one in tables},
    }


def _failures(results: Results) -> tuple[str, ...]:
    return tuple(
        f"{name}: {done.failure}"
        for name, trials in results.items()
        for done in trials
        if done.row is None
    )


def _notes(failures: Sequence[str]) -> list[str]:
    """Report which trials failed."""
    if not failures:
        return []
    one = len(failures) == 1
    head = f"{len(failures)} trial{' has' if one else 's have'} failed and {'is' if one else 'are'}"
    more = len(failures) - _MOST_FAILURES
    rest = [f"And {more} more; the tables have all of them."] if more > 0 else []
    return [f"{head} left out of what follows.", *failures[:_MOST_FAILURES], *rest]

"""Runs a batch: reuses finished trials, runs and stores the rest, and writes the tables."""

import random
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import msgspec

from servoid.batch.experiment import Done, Results, Work
from servoid.batch.store import Store
from servoid.batch.table import check_tables, write_table
from servoid.batch.workers import InProcess, Task, Workers
from servoid.errors import StudyError

_SHUFFLE = 5489  # any number: mixes long and short trials


@dataclass(frozen=True)
class BatchProgress:
    """The progress of a batch: trials done, failed and in total, and the seconds left, if known.

    `recalled` counts the trials that were done before.
    """

    done: int
    failed: int
    total: int
    recalled: int
    seconds_left: float | None


ProgressCallback = Callable[[BatchProgress], None]
_Where = tuple[int, int]  # the index of a work and of a case in it


def run_batch(
    works: Sequence[Work],
    folder: str | Path,
    workers: Workers | None = None,
    watch: ProgressCallback | None = None,
) -> Results:
    """Run all trials that are not done yet, and write a table for each experiment.

    A failed trial is recorded with its error, and tried again when the batch is run again. The
    results depend neither on the order in which trials end nor on the number of workers. `folder`
    receives `EXPERIMENT.parquet`, and `trials`, from which an interrupted batch resumes.

    Raises:
        StudyError: two works share an experiment's name, or the workers cannot run anything.
        MissingExtraError: Parquet or the cluster needs a library that is not installed.
        OutputError: the folder cannot be written.

    """
    check_tables()
    _check_names(works)
    store = Store(Path(folder))
    for work in works:
        store.open(work.experiment)
    found = {
        (number, place): store.recall(work.experiment, case)
        for number, work in enumerate(works)
        for place, case in enumerate(work.cases)
    }
    _run(works, found, store, workers or InProcess(), watch)
    results: dict[str, list[Done]] = {}
    for number, work in enumerate(works):
        ended = [found[number, place] for place in range(len(work.cases))]
        results[work.experiment.name] = [done for done in ended if done is not None]
        name = work.experiment.name
        write_table(work.experiment, results[name], store.folder / f"{name}.parquet")
    return results


def _run(
    works: Sequence[Work],
    found: dict[_Where, Done | None],
    store: Store,
    workers: Workers,
    watch: ProgressCallback | None,
) -> None:
    """Run the missing trials, store their entries, and add them to `found`."""
    missing = _missing(works, found)
    places = sorted(missing.values())
    random.Random(_SHUFFLE).shuffle(places)
    tasks = [_task(works, index, where[0]) for index, where in enumerate(places)]
    count = sum(map(len, places))
    recalled, ended, failed = len(found) - count, 0, 0
    report = watch or (lambda _: None)
    report(BatchProgress(recalled, 0, len(found), recalled, None))
    began = time.monotonic()
    # Closing ends the workers when the caller stops early.
    with closing(workers.entries(tasks)) as entries:
        for index, entry in entries:
            number, place = places[index][0]
            done = store.keep(works[number].experiment, works[number].cases[place], entry)
            found.update(dict.fromkeys(places[index], done))
            ended += len(places[index])
            failed += len(places[index]) if done.row is None else 0
            left = (time.monotonic() - began) / ended * (count - ended)
            report(BatchProgress(recalled + ended, failed, len(found), recalled, left))


def _missing(works: Sequence[Work], found: dict[_Where, Done | None]) -> dict[str, list[_Where]]:
    """Collect the trials that are missing; equal cases share one trial."""
    places: dict[str, list[_Where]] = {}
    for where, done in found.items():
        if done is None:
            work = works[where[0]]
            places.setdefault(work.experiment.key(work.cases[where[1]]), []).append(where)
    return places


def _task(works: Sequence[Work], index: int, where: _Where) -> Task:
    number, place = where
    experiment, case = works[number].experiment, works[number].cases[place]
    content = msgspec.json.encode(case)
    try:
        msgspec.json.decode(content, type=experiment.case)
    except msgspec.ValidationError as error:
        raise StudyError(
            f"a case of the experiment {experiment.name} does not match its type: {error}; "
            "numbers must be finite"
        ) from error
    return Task(index, experiment, content)


def _check_names(works: Sequence[Work]) -> None:
    names = [work.experiment.name for work in works]
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"two works have the experiment '{name}'; merge their cases into one")

"""Where trials run: in this process, in processes of this machine, or on a cluster."""

import os
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol

from servoid.batch.attempt import attempt, failed
from servoid.batch.experiment import Experiment
from servoid.batch.pool import process_pool
from servoid.errors import StudyError

_ATTEMPTS = 3  # deaths of its process after which a trial is the one to blame
_AHEAD = 2  # trials a process has waiting, so that it never idles


@dataclass(frozen=True)
class Task:
    """A trial to run, and its place in the order of the batch."""

    place: int
    experiment: Experiment[Any, Any]
    case: bytes


Entries = Generator[tuple[int, bytes], None, None]
"""The place of each task with its entry."""


class Workers(Protocol):
    """Something that runs trials."""

    @property
    def words(self) -> str:
        """Return where trials run, such as `2 processes`."""
        ...

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks and yield the place of each with its entry, in the order in which they end.

        Raises:
            StudyError: nothing can be run there.

        """
        ...


@dataclass(frozen=True)
class InProcess:
    """Runs one trial after another in this process."""

    @property
    def words(self) -> str:
        """Return where trials run."""
        return "this process"

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks one after another."""
        for task in tasks:
            yield task.place, attempt(task.experiment, task.case)


@dataclass(frozen=True)
class Processes:
    """Runs trials in `count` processes of this machine, each on one core; None takes all cores."""

    count: int | None = None

    @property
    def words(self) -> str:
        """Return where trials run."""
        return "1 process" if self.number == 1 else f"{self.number} processes"

    @property
    def number(self) -> int:
        """Return how many processes there are."""
        return self.count or available_cores()

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks; one whose process dies is tried again, and again alone before it is blamed."""
        deaths = dict.fromkeys((task.place for task in tasks), 0)
        left = {task.place: task for task in tasks}
        while left:
            # What died beside others may be innocent, so it goes alone from then on.
            alone = [task for task in left.values() if deaths[task.place] > 0]
            together = [task for task in left.values() if deaths[task.place] == 0]
            chosen, number = (together, self.number) if together else (alone[:1], 1)
            for place, entry in self._round(chosen, number):
                if entry is not None:
                    del left[place]
                    yield place, entry
                    continue
                deaths[place] += 1
                if deaths[place] >= _ATTEMPTS:
                    task = left.pop(place)
                    yield place, failed(task.case, f"its process died {_ATTEMPTS} times")

    def _round(self, tasks: Sequence[Task], number: int) -> Iterator[tuple[int, bytes | None]]:
        """Run tasks until all are done or a process dies; None is said of those it may have hit."""
        waiting = list(reversed(tasks))
        running: dict[Future[bytes], int] = {}
        try:
            with process_pool(number) as submit:
                while waiting or running:
                    while waiting and len(running) < _AHEAD * number:
                        task = waiting.pop()
                        running[submit(attempt, task.experiment, task.case)] = task.place
                    ended, _ = wait(running, return_when=FIRST_COMPLETED)
                    broken = any(isinstance(one.exception(), BrokenProcessPool) for one in ended)
                    for future in sorted(running if broken else ended, key=lambda x: running[x]):
                        place = running.pop(future)
                        lost = broken and (not future.done() or future.exception() is not None)
                        yield place, None if lost else future.result()
                    if broken:
                        return
        except BrokenProcessPool:
            for place in running.values():
                yield place, None


def available_cores() -> int:
    """Return how many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def workers_for(processes: int | None, cluster: str | None) -> Workers:
    """Choose where to run: on a cluster, in so many processes, or in one for each core.

    Raises:
        StudyError: both are asked for.

    """
    if cluster is not None:
        if processes is not None:
            raise StudyError(
                f"{processes} processes and the cluster {cluster} are both asked for; a cluster "
                "has its own, so leave one of the two out"
            )
        from servoid.batch.cluster import Cluster

        return Cluster(cluster)
    return InProcess() if processes == 1 else Processes(processes)

"""Runs trials in this process, in processes of this machine, or on a cluster."""

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

_ATTEMPTS = 3  # deaths of its process after which a trial counts as failed
_AHEAD = 2  # queued trials for each process, so that it never idles


@dataclass(frozen=True)
class Task:
    """A trial to run, and its index in the batch."""

    place: int
    experiment: Experiment[Any, Any]
    case: bytes


Entries = Generator[tuple[int, bytes], None, None]
"""Pairs of a task's index and its entry."""


class Workers(Protocol):
    """Something that runs trials."""

    @property
    def words(self) -> str:
        """Describe where trials run, such as `2 processes`."""
        ...

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks and yield the index of each with its entry, in the order in which they end.

        Raises:
            StudyError: no trial can run there.

        """
        ...


@dataclass(frozen=True)
class InProcess:
    """Runs one trial after another in this process."""

    @property
    def words(self) -> str:
        """Describe where trials run."""
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
        """Describe where trials run."""
        return "1 process" if self.number == 1 else f"{self.number} processes"

    @property
    def number(self) -> int:
        """Return the number of processes."""
        return self.count or available_cores()

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks; one whose process dies is retried, then retried alone before it fails."""
        deaths = dict.fromkeys((task.place for task in tasks), 0)
        left = {task.place: task for task in tasks}
        while left:
            # A task whose process died beside others may not be the cause, so it runs alone from
            # then on.
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
        """Run tasks until all are done or a process dies; yield None for tasks that may be lost."""
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
    """Return the number of cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def workers_for(processes: int | None, cluster: str | None) -> Workers:
    """Choose where to run: on a cluster, in a number of processes, or in one per core.

    Raises:
        StudyError: both are given.

    """
    if cluster is not None:
        if processes is not None:
            raise StudyError(
                f"{processes} processes and the cluster {cluster} are both given; a cluster "
                "has its own processes, so leave one of the two out"
            )
        from servoid.batch.cluster import Cluster

        return Cluster(cluster)
    return InProcess() if processes == 1 else Processes(processes)

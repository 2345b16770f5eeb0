"""Runs jobs in a thread of its own, so that the caller need not wait."""

import queue
import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

JobT = TypeVar("JobT")

_LOOK_S = 0.001  # between checks for room


class Background(Generic[JobT]):
    """Runs jobs one after another, in their order; at most `most` of them are pending.

    If `can_wait` is false, a job for which there is no room is dropped and counted in `dropped`, of
    all that were `handed` over; otherwise the caller waits for room. Only one thread may hand over
    jobs.
    """

    def __init__(self, work: Callable[[JobT], None], most: int, *, can_wait: bool) -> None:
        self.dropped: int = 0
        self.handed: int = 0
        self._work, self._most, self._can_wait = work, most, can_wait
        # A bounded queue has a lock, on which the other thread may have to wait on a busy machine.
        self._jobs: queue.SimpleQueue[JobT | None] = queue.SimpleQueue()
        self._failure: BaseException | None = None
        self._given_up = False
        self._thread = threading.Thread(target=self._run, name="servoid-recording", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Return the number of pending jobs that have not started."""
        return self._jobs.qsize()

    def put(self, job: JobT) -> bool:
        """Submit a job; return whether it will be run.

        Raises:
            The error of an earlier job.

        """
        self._check()
        self.handed += 1
        while self._jobs.qsize() >= self._most:
            if not self._can_wait:
                self.dropped += 1
                return False
            time.sleep(_LOOK_S)
            self._check()
        self._jobs.put(job)
        return True

    def close(self) -> None:
        """Wait until all jobs are done.

        Raises:
            The error of a job.

        """
        self._jobs.put(None)
        self._thread.join()
        self._check()

    def give_up(self) -> None:
        """Discard the pending jobs."""
        self._given_up = True
        self._jobs.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            if self._failure is None and not self._given_up:
                try:
                    self._work(job)
                except BaseException as error:  # raised at the next `put`
                    self._failure = error

    def _check(self) -> None:
        if self._failure is not None:
            raise self._failure

"""Writes a recording in the background, so that tracking does not wait for the disk."""

from collections.abc import Callable, Iterator
from queue import Queue
from threading import Thread

from servoid.source import RawInstant

_MOST_WAITING = 64  # observations in memory; beyond that, `add` waits, and none is lost

Write = Callable[[Iterator[RawInstant]], object]


class _AbandonedError(Exception):
    """Is raised in a writer to end it without leaving anything behind."""


class QueuedRecording:
    """Passes observations to a writer in a thread of its own.

    At most 64 are queued; then `add` waits. Errors of the writer are raised by `add` or `close`.
    """

    def __init__(self, write: Write) -> None:
        """Begin; `write` consumes the observations until there are no more."""
        self._write, self._error = write, None
        self._queue: Queue[RawInstant | _AbandonedError | None] = Queue(_MOST_WAITING)
        self._thread = Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    def add(self, raw: RawInstant) -> None:
        """Queue one observation."""
        self._check()
        self._queue.put(raw)

    def close(self) -> None:
        """Wait until all is written."""
        self._queue.put(None)
        self._thread.join()
        self._check()

    def abandon(self) -> None:
        """End the writer as if an error had occurred, unless it has ended."""
        self._queue.put(_AbandonedError())
        self._thread.join()

    def _check(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _waiting(self) -> Iterator[RawInstant]:
        while (raw := self._queue.get()) is not None:
            if isinstance(raw, _AbandonedError):
                raise raw
            yield raw

    def _run(self) -> None:
        try:
            self._write(self._waiting())
        except _AbandonedError:
            return
        except BaseException as error:  # raised in `add` or `close`
            self._error = error
            while isinstance(self._queue.get(), RawInstant):  # so that nobody waits forever
                pass

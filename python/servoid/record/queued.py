"""Writes a recording beside the work, so that whoever tracks waits for no disk."""

from collections.abc import Callable, Iterator
from queue import Queue
from threading import Thread

from servoid.source import RawInstant

_MOST_WAITING = 64  # observations in memory; then whoever adds one waits, and none is lost

Write = Callable[[Iterator[RawInstant]], object]


class _AbandonedError(Exception):
    """Ends a writer so that it leaves nothing behind."""


class QueuedRecording:
    """Hands observations to what writes them, in a thread of its own.

    At most 64 wait; then `add` waits. What the writer raises is raised by `add` or `close`.
    """

    def __init__(self, write: Write) -> None:
        """Begin; `write` takes observations until there are no more."""
        self._write, self._error = write, None
        self._queue: Queue[RawInstant | _AbandonedError | None] = Queue(_MOST_WAITING)
        self._thread = Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    def add(self, raw: RawInstant) -> None:
        """Keep one more observation, soon."""
        self._check()
        self._queue.put(raw)

    def close(self) -> None:
        """Wait until all is written."""
        self._queue.put(None)
        self._thread.join()
        self._check()

    def abandon(self) -> None:
        """End the writer as if an error had come, unless it has ended."""
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
        except BaseException as error:  # whoever adds or closes hears of it
            self._error = error
            while isinstance(self._queue.get(), RawInstant):  # and never waits for ever
                pass

"""Writes a recording beside the work, so that whoever tracks waits for no disk."""

from collections.abc import Callable, Iterator
from queue import Queue
from threading import Thread

from servoid.source import RawInstant

_MOST_WAITING = 64  # observations in memory; then whoever adds one waits, and none is lost

Write = Callable[[Iterator[RawInstant]], object]


class QueuedRecording:
    """Hands observations to what writes them, in a thread of its own.

    At most 64 wait; then `add` waits. What the writer raises is raised by `add` or `close`.
    """

    def __init__(self, write: Write) -> None:
        """Begin; `write` takes observations until there are no more."""
        self._write, self._error = write, None
        self._queue: Queue[RawInstant | None] = Queue(_MOST_WAITING)
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

    def _check(self) -> None:
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _waiting(self) -> Iterator[RawInstant]:
        while (raw := self._queue.get()) is not None:
            yield raw

    def _run(self) -> None:
        waiting = self._waiting()
        try:
            self._write(waiting)
        except BaseException as error:  # whoever adds or closes hears of it
            self._error = error
            for _ in waiting:  # and never waits for ever
                pass

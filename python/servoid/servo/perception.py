"""What the loop receives of the target: observations that were tracked, in turn or in a thread."""

import time
from collections import deque
from dataclasses import dataclass, replace
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Protocol

from servoid.errors import ServoError
from servoid.source.source import Instant, Source
from servoid.track import Estimate, Follower, depths_for

_POLL_S = 0.002  # between questions for a new observation
_KEPT = 16  # observations that were tracked and not yet asked for; each holds its images
_CLOSING_S = 2.0  # in which a tracker must return from its last observation


@dataclass(frozen=True, eq=False)
class TrackedInstant:
    """An observation and what the tracker made of it, None if no camera delivered an image.

    `track_s` is the time, on the wall, that the tracker took. `dropped` counts the observations
    before this one and after the last that was told that arrived and were never tracked, or were
    tracked and not asked for in time.
    """

    instant: Instant
    estimate: Estimate | None
    track_s: float
    dropped: int


class Perception(Protocol):
    """Tells what was tracked."""

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return what was tracked since it was last asked, in order, each once.

        Raises:
            ServoidError: tracking has failed.

        """
        ...


class TrackingInTurn:
    """Tracks the newest observation whenever it is asked, and lets the caller wait for it.

    The same observations give the same estimates, so that a simulated run can be repeated.
    """

    def __init__(self, source: Source, tracker: Follower) -> None:
        """Take a tracker that has started."""
        self._source, self._tracker = source, tracker
        self._index: int | None = None

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return the newest observation, tracked; nothing if none has arrived.

        Raises:
            TrackError: the observation does not fit the tracker.

        """
        instant = self._source.newest()
        if instant is None:
            return ()
        began = time.perf_counter()
        estimate = _estimate(self._tracker, instant)
        took = time.perf_counter() - began
        dropped = 0 if self._index is None else instant.index - self._index - 1
        self._index = instant.index
        return (TrackedInstant(instant, estimate, took, dropped),)


class TrackingThread:
    """Tracks in a thread of its own, which asks the source for its newest observation; a context.

    Whoever asks for what was tracked never waits for the tracker. While one observation is being
    tracked those that arrive are dropped but for the newest, and of estimates that are not asked
    for the oldest are dropped; both are counted. The source and the tracker belong to the thread
    until `close`.
    """

    def __init__(self, source: Source, tracker: Follower) -> None:
        """Begin with a tracker that has started."""
        self._inner = TrackingInTurn(source, tracker)
        self._found: deque[TrackedInstant] = deque()
        self._error: Exception | None = None
        self._lock, self._over = Lock(), Event()
        self._thread = Thread(target=self._run, name="tracking", daemon=True)
        self._thread.start()

    def __enter__(self) -> "TrackingThread":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the thread; a tracker that hangs is not waited for."""
        self._over.set()
        self._thread.join(_CLOSING_S)

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return what was tracked since it was last asked, in order, each once.

        Raises:
            ServoError: tracking has failed, or was closed.

        """
        with self._lock:
            found = tuple(self._found)
            self._found.clear()
        if found:
            return found
        if self._error is not None:
            said = str(self._error) or type(self._error).__name__
            raise ServoError(f"tracking failed: {said}") from self._error
        if self._over.is_set():
            raise ServoError("tracking was closed; ask for what is tracked inside its context")
        return ()

    def _run(self) -> None:
        try:
            while not self._over.is_set():
                found = self._inner.tracked()
                if not found:
                    self._over.wait(_POLL_S)
                for one in found:
                    self._keep(one)
        except Exception as error:  # whatever it is, it must end the loop, not this thread alone
            self._error = error

    def _keep(self, one: TrackedInstant) -> None:
        with self._lock:
            self._found.append(one)
            if len(self._found) > _KEPT:
                oldest, after = self._found.popleft(), self._found[0]
                passed = after.dropped + oldest.dropped + 1
                self._found[0] = replace(after, dropped=passed)


def _estimate(tracker: Follower, instant: Instant) -> Estimate | None:
    """Return where the target was, None if no camera delivered an image."""
    if instant.is_dark:
        return None
    seen = (instant.time_s, instant.world_from_camera, instant.images)
    return tracker.step(*seen, **depths_for(tracker, instant))

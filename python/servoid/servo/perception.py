"""Delivers tracked observations to the loop, tracked in the same thread or in another one."""

import time
from collections import deque
from dataclasses import dataclass, replace
from threading import Event, Lock, Thread
from typing import Protocol, runtime_checkable

from servoid.errors import ServoError
from servoid.source import Instant, Source
from servoid.track import Estimate, Follower, depths_for

_POLL_S = 0.002  # between polls for a new observation
_KEPT = 16  # tracked observations that wait to be fetched; each holds its images
_CLOSING_S = 2.0  # within which the tracker must finish its last observation


@dataclass(frozen=True, eq=False)
class TrackedInstant:
    """An observation and the tracker's estimate, None if no camera delivered an image.

    `track_s` is the wall-clock time of the tracker. `dropped` counts the observations since the
    last delivered one that were never tracked, or were tracked and not fetched in time.
    """

    instant: Instant
    estimate: Estimate | None
    track_s: float
    dropped: int


class Perception(Protocol):
    """A source of tracked observations."""

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return what was tracked since it was last asked, in order, each once.

        Raises:
            ServoidError: tracking has failed.

        """
        ...


@runtime_checkable
class Busy(Protocol):
    """A perception that knows for how long its tracker has been at one observation."""

    @property
    def busy_s(self) -> float:
        """Return that time in s of the wall clock, 0 if it is at none."""
        ...


class TrackingInTurn:
    """Tracks the newest observation at each call; the caller waits for it.

    The same observations give the same estimates, so that a simulated run is repeatable.
    """

    def __init__(self, source: Source, tracker: Follower) -> None:
        """Take a tracker that has started."""
        self._source, self._tracker = source, tracker
        self._index: int | None = None
        self._began_s: float | None = None

    @property
    def busy_s(self) -> float:
        """Return for how long the tracker has been at an observation, in s of the wall clock."""
        began_s = self._began_s
        return 0.0 if began_s is None else time.perf_counter() - began_s

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return the newest observation, tracked; empty if none has arrived.

        Raises:
            TrackError: the observation does not fit the tracker.

        """
        instant = self._source.newest()
        if instant is None:
            return ()
        self._began_s = began_s = time.perf_counter()
        estimate = _estimate(self._tracker, instant)
        took, self._began_s = time.perf_counter() - began_s, None
        dropped = 0 if self._index is None else instant.index - self._index - 1
        self._index = instant.index
        return (TrackedInstant(instant, estimate, took, dropped),)


class TrackingThread:
    """Tracks the source's newest observation in a thread of its own; a context manager.

    `tracked` never waits for the tracker. Of the observations that arrive while one is tracked only
    the newest is kept, and of estimates that are not fetched the oldest are dropped; both are
    counted. The source and the tracker belong to the thread until `close`.
    """

    def __init__(self, source: Source, tracker: Follower) -> None:
        """Start the thread, with a tracker that has started."""
        self._inner = TrackingInTurn(source, tracker)
        self._found: deque[TrackedInstant] = deque()
        self._error: BaseException | None = None
        self._lock, self._over = Lock(), Event()
        self._thread = Thread(target=self._run, name="tracking", daemon=True)
        self._thread.start()

    def __enter__(self) -> "TrackingThread":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the thread, without waiting for a tracker that hangs."""
        self._over.set()
        self._thread.join(_CLOSING_S)

    @property
    def busy_s(self) -> float:
        """Return for how long the tracker has been at an observation, in s of the wall clock."""
        return self._inner.busy_s

    def tracked(self) -> tuple[TrackedInstant, ...]:
        """Return what was tracked since it was last asked, in order, each once.

        Raises:
            ServoError: tracking has failed, was ended, as by SystemExit, or was closed.

        """
        with self._lock:
            found = tuple(self._found)
            self._found.clear()
        if found:
            return found
        if self._error is not None:
            raise ServoError(_why(self._error)) from self._error
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
        except BaseException as error:  # it must end the loop, not only this thread
            self._error = error

    def _keep(self, one: TrackedInstant) -> None:
        with self._lock:
            self._found.append(one)
            if len(self._found) > _KEPT:
                oldest, after = self._found.popleft(), self._found[0]
                passed = after.dropped + oldest.dropped + 1
                self._found[0] = replace(after, dropped=passed)


def _why(error: BaseException) -> str:
    """Say why no thread tracks any more."""
    kind, text = type(error).__name__, str(error)
    if isinstance(error, Exception):
        return f"tracking failed: {text or kind}"
    return f"the tracker ended its thread by {kind}{f' ({text})' if text else ''}"


def _estimate(tracker: Follower, instant: Instant) -> Estimate | None:
    """Return the estimate, None if no camera delivered an image."""
    if instant.is_dark:
        return None
    seen = (instant.time_s, instant.world_from_camera, instant.images)
    return tracker.step(*seen, **depths_for(tracker, instant))

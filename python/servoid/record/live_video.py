"""Writes a real-time video of tracking in the background."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Full, Queue
from threading import Thread

import numpy as np
from numpy.typing import NDArray

from servoid.record.overlay import Overlay
from servoid.record.video_file import image_video
from servoid.track import TrackStep

_RATE_HZ = 30.0
_MOST_STILL_S = 10.0  # longest time for which one image is shown if none follows
_MOST_WAITING = 8  # images waiting to be encoded; if more come, the previous one is shown longer

Image = NDArray[np.uint8]


@contextmanager
def live_video(path: str | Path, overlay: Overlay) -> Iterator[Callable[[TrackStep], None]]:
    """Write a video of steps as they come; call the yielded function with each.

    Each step is shown until the next one. Images are encoded in a thread of their own; if it does
    not keep up, steps are dropped.

    Raises:
        OutputError: there is no encoder, or the file cannot be written.

    """
    with image_video(path, overlay.size_px, _RATE_HZ) as add:
        encoder = _Encoder(add)
        try:
            yield lambda step: encoder.add(overlay, step)
        finally:
            encoder.close()


class _Encoder:
    """Encodes images in the background, each repeated for its duration."""

    def __init__(self, add: Callable[[Image], None]) -> None:
        self._add, self._first_s, self._shown = add, float("nan"), 0
        self._queue: Queue[tuple[Image, int] | None] = Queue(_MOST_WAITING)
        self._last: Image | None = None
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="video", daemon=True)
        self._thread.start()

    def add(self, overlay: Overlay, step: TrackStep) -> None:
        """Show a step from its time onwards."""
        if self._last is None:
            self._first_s, self._last = step.instant.time_s, overlay.draw(step)
            return
        due = round(_RATE_HZ * (step.instant.time_s - self._first_s))
        if due <= self._shown:
            return
        times = min(due - self._shown, round(_RATE_HZ * _MOST_STILL_S))
        try:
            self._queue.put_nowait((self._last, times))
        except Full:
            return  # the previous image is shown longer
        self._shown, self._last = due, overlay.draw(step)

    def close(self) -> None:
        """Show the last step, and wait until all images are encoded."""
        if self._last is not None:
            self._queue.put((self._last, 1))
        self._queue.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            image, times = item
            if self._error is not None:
                continue  # empty the queue, so that nobody waits forever
            try:
                for _ in range(times):
                    self._add(image)
            except BaseException as error:  # raised in `close`
                self._error = error

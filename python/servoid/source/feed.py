"""Yields the observations of a live source one after another, until a condition ends it."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from servoid.camera import IdealCamera
from servoid.capture import Capture
from servoid.errors import CaptureError
from servoid.source.instants import cameras_of
from servoid.source.raw import RawInstant, RawSource, capture_of_raw, instant_of
from servoid.source.source import Instant

_POLL_S = 0.001
_FIRST_S = 3.0  # within which all cameras should start
_MOST_WHY = 4  # notices that give the reason why no image came
_REPORT_S = 0.25  # period of reports that no image comes

Keep = Callable[[RawInstant], None]


class Feed:
    """Yields the newest observation on each request, and waits for it.

    The first one has images of all cameras, or of those that have started after three seconds.
    Observations are numbered in the order in which they are yielded, so a recording of them has the
    same numbers. `missed` counts those that arrived in between, and `dark` those without an image
    of any camera, which are neither numbered nor kept unless it `keeps_dark` ones.
    """

    def __init__(
        self,
        source: RawSource,
        *,
        name: str,
        is_over: Callable[[], bool] = lambda: False,
        keep: Keep | None = None,
        keeps_dark: bool = True,
        report_silence: Callable[[str | None], None] = lambda _: None,
    ) -> None:
        """Read from a source, called `name` in messages, until `is_over`.

        `keep` receives each observation that is yielded. `report_silence` receives the reason
        why no image comes, and None once one does.
        """
        self._source, self._name, self._is_over = source, name, is_over
        self._keep, self._report_silence = keep, report_silence
        self._keeps_dark = keeps_dark
        self._ideals = tuple(IdealCamera(camera.lens) for camera in source.rig)
        self._count, self._last_index = 0, -1
        self._first: RawInstant | None = None
        self.missed: int = 0
        self.dark: int = 0

    def __iter__(self) -> Iterator[Instant]:
        """Yield the observations after the first."""
        for raw in self.raw():
            yield instant_of(raw, self._source.rig, self._ideals)

    def raw(self) -> Iterator[RawInstant]:
        """Yield the observations after the first, as the lenses recorded them."""
        while True:
            raw = self._next()
            if raw is None:
                return
            yield self._handed_out(raw)

    def first(self) -> tuple[Capture, Instant]:
        """Return the first observation as a capture of one, and as the first instant.

        Raises:
            CaptureError: the source ended before an observation came.

        """
        begun_s = time.monotonic()
        notices: list[str] = []
        while self._first is None:
            raw = self._next()
            if raw is None:
                why = self._source.silence() or "; ".join(notices[-_MOST_WHY:])
                raise CaptureError(f"{self._name}: not one image came{f': {why}' if why else ''}")
            notices = list(dict.fromkeys([*notices, *raw.notices]))
            # Cameras do not start simultaneously, and the first observation should have all images.
            is_whole = all(image is not None for image in raw.images)
            if is_whole or (not raw.is_dark and time.monotonic() > begun_s + _FIRST_S):
                self._first = replace(raw, notices=tuple(notices))
                self._handed_out(self._first)
        raw = replace(self._first, index=0)
        capture = capture_of_raw(Path(self._name), self._source.rig, raw)
        cameras_of(capture)  # raises if a lens sees nothing
        return capture, instant_of(raw, self._source.rig, self._ideals)

    @property
    def count(self) -> int:
        """Return how many observations were yielded."""
        return self._count

    def _next(self) -> RawInstant | None:
        begun_s = reported_s = time.monotonic()
        while not self._is_over():
            raw = self._source.newest_raw()
            if raw is not None:
                if reported_s > begun_s:
                    self._report_silence(None)
                return raw
            now_s = time.monotonic()
            if now_s > reported_s + _REPORT_S:
                reported_s = now_s
                self._report_silence(self._source.silence())
            time.sleep(_POLL_S)
        return None

    def _handed_out(self, raw: RawInstant) -> RawInstant:
        if self._last_index >= 0:
            self.missed += max(0, raw.index - self._last_index - 1)
        self._last_index = raw.index
        if raw.is_dark:
            self.dark += 1
            if not self._keeps_dark:
                return raw
        raw = replace(raw, index=self._count)
        self._count += 1
        if self._keep is not None:
            self._keep(raw)
        return raw

"""The input of `track`: a capture from its first observation to its last, or a live source."""

import itertools
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path

from servoid.capture import Capture
from servoid.cli.source.recorders import recording_of
from servoid.exchange.bags.writing import McapRun, RunRig, mcap_run
from servoid.opening import GivenCalibration, SourceWord, open_live, open_recorded
from servoid.record import Overlay, QueuedRecording, live_video, overlay_video
from servoid.source import Feed, MountedCamera, RawInstant
from servoid.track import Request, Subject, TrackStep, cameras_of, follow, follow_live

_VIDEO_HZ = 10.0  # rate of a capture without times
_FIRST_S = 10.0  # time allowed for the first image

Draw = Callable[[TrackStep], None]


@dataclass(frozen=True)
class RecordedFootage:
    """A recorded capture."""

    capture: Capture
    notes: tuple[str, ...] = ()

    def steps(self, subjects: Sequence[Subject], request: Request) -> Iterator[TrackStep]:
        """Track through the observations that the request selects."""
        return follow(self.capture, subjects, request)

    def share(self, step: TrackStep) -> float | None:
        """Return the share done after a step."""
        return step.share

    @contextmanager
    def video(self, path: Path, objects: int, request: Request) -> Iterator[Draw]:
        """Write a video in real time, as far as the capture has times."""
        hz = _video_hz(self.capture, request)
        with overlay_video(path, _overlay(self.capture, objects), hz) as draw:
            yield draw

    def mcap(self, path: Path) -> AbstractContextManager[McapRun]:
        """Record the run as MCAP, with the images as they are stored; nothing is dropped."""
        return mcap_run(path, RunRig.of_capture(self.capture), can_wait=True)


class LiveFootage:
    """The images of a live source from its first one on, for `duration_s` or until Ctrl-C.

    A duration counts from the first image, or from the first pose where objects are tracked.

    Times are in seconds since it was opened, `began`. Tracked images are recorded to `record`.
    `report_silence` is called with the reason while no image comes, and with None once one does.
    """

    def __init__(
        self,
        word: SourceWord,
        known: GivenCalibration,
        *,
        duration_s: float | None = None,
        record: Path | None = None,
        is_calibrated: bool = True,
        keeps_dark: bool = True,
    ) -> None:
        """Open the source, and wait for its first image.

        Unless it `is_calibrated`, the recording holds no calibration, and unless it `keeps_dark`
        ones, no observation in which no camera has an image.

        Raises:
            CaptureError: the source does not answer, or no image came.
            OutputError: nothing can be recorded at `record`.

        """
        began_s = time.monotonic()
        self.report_silence: Callable[[str | None], None] = lambda _: None
        self.began: datetime = datetime.now(timezone.utc)
        self._duration_s, self._first_s, self._opened_s = duration_s, 0.0, began_s
        self._is_starting = False
        with ExitStack() as stack:
            opened = open_live(word, known, clock=lambda: time.monotonic() - began_s)
            self._source = stack.enter_context(opened.source)
            self._recording: QueuedRecording | None = None
            if record is not None:
                self._recording = recording_of(
                    record, self._source.rig, self.began, is_calibrated=is_calibrated
                )
                stack.callback(self._recording.abandon)
            self._feed = Feed(
                self._source,
                name=word.text,
                is_over=self._is_over,
                keep=self._keep,
                keeps_dark=keeps_dark,
                report_silence=lambda why: self.report_silence(why),
            )
            self.notes: tuple[str, ...] = opened.notes
            self._opened_s = time.monotonic()
            self.capture: Capture
            seen, first = self._feed.first()
            self.capture = replace(seen, measured=known.is_measured)
            self.first_notices: tuple[str, ...] = first.notices
            self._first_s = time.monotonic()
            stack.pop_all()

    def __enter__(self) -> "LiveFootage":
        return self

    def __exit__(self, *_: object) -> None:
        self._source.close()
        if self._recording is not None:
            self._recording.abandon()

    def steps(self, subjects: Sequence[Subject], request: Request) -> Iterator[TrackStep]:
        """Track through the observations as they arrive; the duration begins at the first pose."""
        self._is_starting = True
        for step in follow_live(self._feed, subjects, request):
            if self._is_starting:
                self._is_starting, self._first_s = False, time.monotonic()
            yield step

    def finish_recording(self) -> None:
        """Write the rest of a recording, and move it to its path.

        Raises:
            OutputError: it cannot be written whole.

        """
        if self._recording is not None:
            recording, self._recording = self._recording, None
            recording.close()

    def raw(self) -> Iterator[RawInstant]:
        """Yield the observations after the first, as the cameras recorded them."""
        return self._feed.raw()

    def share(self, step: TrackStep) -> float | None:
        """Return the share of the duration that has passed, None without a duration."""
        del step
        return self.passed_share

    @property
    def passed_share(self) -> float | None:
        """Return the share of the duration that has passed, None without a duration."""
        if self._duration_s is None:
            return None
        return min(1.0, (time.monotonic() - self._first_s) / self._duration_s)

    @property
    def missed(self) -> int:
        """Return the number of observations that arrived and were dropped."""
        return self._feed.missed

    @property
    def rig(self) -> tuple[MountedCamera, ...]:
        """Return the cameras, with their lenses."""
        return self._source.rig

    @property
    def dark(self) -> int:
        """Return the number of observations in which no camera had an image."""
        return self._feed.dark

    @contextmanager
    def video(self, path: Path, objects: int, request: Request) -> Iterator[Draw]:
        """Write a video in real time: each image is shown until the next one arrived."""
        del request
        with live_video(path, _overlay(self.capture, objects)) as draw:
            yield draw

    def mcap(self, path: Path) -> AbstractContextManager[McapRun]:
        """Record the run as MCAP, with undistorted images; those that come too fast are dropped."""
        names = [camera.name for camera in self.capture.cameras]
        rig = RunRig.of_source(cameras_of(self.capture), names)
        return mcap_run(path, rig, can_wait=False)

    def _is_over(self) -> bool:
        if self._source.is_over:
            return True
        if not self._first_s:
            return time.monotonic() - self._opened_s > _FIRST_S
        if self._duration_s is None or self._is_starting:
            return False
        return time.monotonic() - self._first_s >= self._duration_s

    def _keep(self, raw: RawInstant) -> None:
        if self._recording is not None:
            self._recording.add(raw)

    @property
    def first_time_s(self) -> float:
        """Return the time of the first observation."""
        times_s = self.capture.times_s
        return times_s[0] if times_s else 0.0

    @property
    def handed_out(self) -> int:
        """Return the number of observations handed out."""
        return self._feed.count


Footage = RecordedFootage | LiveFootage


@contextmanager
def open_footage(
    word: SourceWord,
    known: GivenCalibration,
    *,
    topics: Sequence[str] = (),
    world: str | None = None,
    unit_m: float | None = None,
    duration_s: float | None = None,
    record: Path | None = None,
) -> Iterator[Footage]:
    """Open a SOURCE for the block.

    `topics`, `world` and `unit_m` are those of `open_any`; the other arguments are those of
    `LiveFootage`.

    Raises:
        CaptureError: it cannot be opened, or has no calibration.
        OutputError: nothing can be recorded at `record`.

    """
    if word.is_live:
        with LiveFootage(word, known, duration_s=duration_s, record=record) as footage:
            yield footage
        return
    opened = open_recorded(word, known, topics=topics, world=world, unit_m=unit_m)
    yield RecordedFootage(opened.capture, opened.notes)


def _overlay(capture: Capture, objects: int) -> Overlay:
    return Overlay(cameras_of(capture), [camera.name for camera in capture.cameras], objects)


def _video_hz(capture: Capture, request: Request) -> float:
    """Return the image rate of a video in real time."""
    times_s = capture.times_s
    if times_s is None:
        return capture.rate_hz or _VIDEO_HZ
    shown = times_s[request.observations][:: request.every]
    steps = [abs(after - before) for before, after in itertools.pairwise(shown)]
    usual_s = statistics.median(steps) if steps else 0.0
    return min(max(1.0 / usual_s, 1.0), 240.0) if usual_s > 0.0 else _VIDEO_HZ

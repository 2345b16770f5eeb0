"""Plays a recorded video as a live camera would have sent it: at its own rate, and once."""

import time
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any

from servoid.camera import shortage
from servoid.rates import ASSUMED_HZ
from servoid.source.delivery import Delivery, EndedError
from servoid.words import digits

if TYPE_CHECKING:
    import cv2

_LONGEST_END_S = 1.0
_LONGEST_GAP_S = 5.0  # between two images; a longer gap in the film's times is played as this one
_GAP_PERIODS = 2.0  # the same for films of few images a second


@dataclass(frozen=True, eq=False)
class _Image:
    """One image of a film, None if it cannot be decoded, and its time in the film as played."""

    pixels: Any | None
    stamp_s: float
    notices: tuple[str, ...]


class FilmVideo:
    """Delivers each image of a film when it is due, stamped with its time in the film.

    The first image is due at once. Images that would be late by an interval are missing, as they
    are of a camera whose driver is too slow. A film that is decoded or arrives too slowly is played
    as slowly, and long gaps in its times are played as five seconds. The last image of a film that
    breaks off before the end in its header says so in its notices.
    """

    def __init__(self, video: "cv2.VideoCapture") -> None:
        """Play a video from where it is; without times of its own, at its rate or at 30 Hz."""
        import cv2

        self._video = video
        rate_hz = video.get(cv2.CAP_PROP_FPS)
        self._period_s = 1.0 / (rate_hz if 0.0 < rate_hz < float("inf") else ASSUMED_HZ)
        self._promised = video.get(cv2.CAP_PROP_FRAME_COUNT)
        self._count = max(0, round(video.get(cv2.CAP_PROP_POS_FRAMES)))
        self._shown: _Image | None = None
        self._ahead: _Image | None = None  # read before it is shown, as it may not exist
        self._time_s: float | None = None  # of the image that was read last, in the container
        self._cut_s = 0.0  # of the film's times, where they have long gaps
        self._origin_s = 0.0  # when, on the computer's clock, the film began
        self._missing = 0
        self._ending: str | None = None
        self._interrupted = Event()

    def grab(self) -> bool:
        """Wait until the next image is due; return False if the wait was interrupted.

        Raises:
            EndedError: the film has ended.

        """
        shown = self._ahead or self._read()
        if shown is None:
            self._interrupted.wait(min(self._period_s, _LONGEST_END_S))  # the last image is shown
            raise EndedError(self._ending or "the film has ended")
        self._missing, self._ahead = 0, self._read()
        if self._shown is None:
            self._origin_s = time.monotonic() - shown.stamp_s
        late_s = self._late_s(shown)
        while late_s > self._period_s and self._ahead is not None:
            self._missing += 1
            shown, self._ahead = self._ahead, self._read()
            before_s, late_s = late_s, self._late_s(shown)
            if late_s >= before_s:  # it comes slower than it plays: nothing is gained by skipping
                self._origin_s += late_s
                late_s = 0.0
        self._shown = shown
        return not self._interrupted.wait(max(0.0, -late_s))

    def retrieve(self) -> tuple[bool, Delivery | None]:
        """Return whether the image could be decoded, and the image with its time in the film."""
        shown = self._shown
        if shown is None or shown.pixels is None:
            return False, None
        notices = shown.notices
        if self._ahead is None and self._ending is not None:
            notices = (*notices, self._ending)
        return True, Delivery(
            (shown.pixels,), stamp_s=shown.stamp_s, missing=self._missing, notices=notices
        )

    def interrupt(self) -> None:
        """End a wait for an image, from another thread; no further image is delivered."""
        self._interrupted.set()

    def release(self) -> None:
        """Close the film."""
        self._video.release()

    def _late_s(self, image: _Image) -> float:
        return time.monotonic() - (self._origin_s + image.stamp_s)

    def _read(self) -> _Image | None:
        """Read the next image; None at the end."""
        import cv2

        if not self._video.grab():
            short = shortage(self._count, self._promised)
            self._ending = None if short is None else f"the film breaks off: {short}"
            return None
        self._count += 1
        time_s = self._video.get(cv2.CAP_PROP_POS_MSEC) / 1e3
        notices: tuple[str, ...] = ()
        if self._time_s is not None:
            if not time_s > self._time_s:  # some containers have no times
                time_s = self._time_s + self._period_s
            gap_s = time_s - self._time_s
            longest_s = max(_LONGEST_GAP_S, _GAP_PERIODS * self._period_s)
            if gap_s > longest_s:
                self._cut_s += gap_s - longest_s
                notices = (
                    f"the film's times jump by {digits(round(gap_s, 1))} s before this image; it "
                    f"is shown after {digits(longest_s)} s",
                )
        self._time_s = time_s
        found, pixels = self._video.retrieve()
        return _Image(pixels if found else None, time_s - self._cut_s, notices)

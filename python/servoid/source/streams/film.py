"""Plays a recorded video as a live camera would have sent it: at its own rate, and once."""

import time
from typing import TYPE_CHECKING

from servoid.rates import ASSUMED_HZ
from servoid.source.delivery import Delivery, EndedError

if TYPE_CHECKING:
    import cv2

_LONGEST_END_S = 1.0


class FilmVideo:
    """Delivers each image of a film when it is due, stamped with its time in the film.

    The first image is due at once. Images that would be late by an interval are missing, as they
    are of a camera whose driver is too slow. A film that is decoded or arrives too slowly is played
    as slowly.
    """

    def __init__(self, video: "cv2.VideoCapture") -> None:
        """Play a video from where it is; without times of its own, at its rate or at 30 Hz."""
        import cv2

        self._video = video
        rate_hz = video.get(cv2.CAP_PROP_FPS)
        self._period_s = 1.0 / (rate_hz if 0.0 < rate_hz < float("inf") else ASSUMED_HZ)
        self._stamp_s: float | None = None
        self._origin_s = 0.0  # when, on the computer's clock, the film began
        self._missing = 0

    def grab(self) -> bool:
        """Wait until the next image is due.

        Raises:
            EndedError: the film has ended.

        """
        self._missing = 0
        late_s = time.monotonic() - self._step()
        while late_s > self._period_s:
            self._missing += 1
            before_s, late_s = late_s, time.monotonic() - self._step()
            if late_s >= before_s:  # it comes slower than it plays: nothing is gained by skipping
                self._origin_s += late_s
                late_s = 0.0
        time.sleep(max(0.0, -late_s))
        return True

    def retrieve(self) -> tuple[bool, Delivery | None]:
        """Return whether the image could be decoded, and the image with its time in the film."""
        found, pixels = self._video.retrieve()
        if not found:
            return False, None
        return True, Delivery((pixels,), stamp_s=self._stamp_s, missing=self._missing)

    def release(self) -> None:
        """Close the film."""
        self._video.release()

    def _step(self) -> float:
        """Go to the next image, and return when it is due on the computer's clock."""
        import cv2

        if not self._video.grab():
            time.sleep(min(self._period_s, _LONGEST_END_S))  # for which the last image is shown
            raise EndedError("the film has ended")
        time_s = self._video.get(cv2.CAP_PROP_POS_MSEC) / 1e3
        if self._stamp_s is None:
            self._origin_s = time.monotonic() - time_s
        elif not time_s > self._stamp_s:  # some containers have no times
            time_s = self._stamp_s + self._period_s
        self._stamp_s = time_s
        return self._origin_s + time_s

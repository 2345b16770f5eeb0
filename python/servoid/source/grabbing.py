"""Fetches the images of one live camera in a thread of its own."""

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Lock, Thread
from typing import Any, Protocol, runtime_checkable

from servoid.errors import CaptureError

_KEPT = 4  # images, among which the one nearest to the other cameras' is chosen
_RETRY_S = 0.02
_TRIES = 50  # in a row, after which a camera is opened anew: it may have been plugged in again
_CLOSING_S = 2.0  # in which a driver must return from its last image
_ADDRESS = "://"
_PASSWORD = re.compile(r"//[^/@]*@")  # of an address, which no message shall show
_PIPELINE = " ! "  # joins the parts of a GStreamer pipeline


@runtime_checkable
class Video(Protocol):
    """What servoid needs of a camera: `cv2.VideoCapture` has it, and a driver's own can."""

    def grab(self) -> bool:
        """Wait for the next image, and say if there is one."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return if it could be decoded, and it: (H, W) or (H, W, 3) uint8, blue first."""
        ...

    def release(self) -> None:
        """Close the camera."""
        ...


@dataclass(frozen=True, eq=False)
class Shot:
    """An image (H, W) or (H, W, 3) uint8, blue first, and when it had come, in seconds.

    `number` counts the images of its camera that came, from 1.
    """

    time_s: float
    pixels: Any
    number: int


class Grabber:
    """Fetches images as they come, and keeps the last ones; a failure is tried again.

    With `reopen` a camera that goes on failing is opened anew.
    """

    def __init__(
        self,
        name: str,
        video: Video,
        clock: Callable[[], float],
        reopen: Callable[[], Video] | None = None,
    ) -> None:
        self._video, self._clock, self._reopen = video, clock, reopen
        self._shots: deque[Shot] = deque(maxlen=_KEPT)
        self._fault: str | None = None
        self._count = 0
        self._lock, self._over = Lock(), Event()
        self._last_s = clock()
        self._thread = Thread(target=self._run, name=f"camera {name}", daemon=True)
        self._thread.start()

    def shots(self) -> tuple[Shot, ...]:
        """Return the last images, the oldest first."""
        with self._lock:
            return tuple(self._shots)

    def silence(self, now_s: float) -> tuple[float, str]:
        """Return for how many seconds no image has come, and what is known of the reason."""
        with self._lock:
            fault = "" if self._fault is None else f": {self._fault}"
            return now_s - self._last_s, fault

    def close(self) -> None:
        """End the thread, which closes the camera.

        A driver that hangs is not waited for; the camera is closed once it returns.
        """
        self._over.set()
        self._thread.join(_CLOSING_S)

    def _run(self) -> None:
        try:
            self._grab_on()
        finally:
            self._video.release()

    def _grab_on(self) -> None:
        failures = 0
        while not self._over.is_set():
            fault = self._fetch()
            failures = 0 if fault is None else failures + 1
            if self._reopen is not None and failures and failures % _TRIES == 0:
                fault = self._anew(self._reopen)
            if fault is not None:
                with self._lock:
                    self._fault = fault
                self._over.wait(_RETRY_S)

    def _anew(self, reopen: Callable[[], Video]) -> str:
        try:
            self._video.release()
            self._video = reopen()
        except Exception as error:  # the next try may do
            return _said(error)
        return "the camera was opened anew"

    def _fetch(self) -> str | None:
        """Take one image; return why there is none, or None."""
        try:
            if not self._video.grab():
                return "the camera delivers none"
            time_s = self._clock()
            found, pixels = self._video.retrieve()
        except Exception as error:  # whatever a driver raises, the arm must hear of it as silence
            return _said(error)
        if not found:
            return "the image cannot be decoded"
        with self._lock:
            self._count += 1
            self._shots.append(Shot(time_s, pixels, self._count))
            self._last_s, self._fault = time_s, None
        return None


def _said(error: Exception) -> str:
    return str(error) or type(error).__name__


def reopening(
    name: str, device: int | str | Video, size_px: tuple[int, int]
) -> Callable[[], Video] | None:
    """Return what opens a device anew, None for a file or a driver's object."""
    if isinstance(device, int) or (isinstance(device, str) and _ADDRESS in device):
        return lambda: opened(name, device, size_px)
    return None


def opened(name: str, device: int | str | Video, size_px: tuple[int, int]) -> Video:
    """Open a device by its number, or a file, an address or a GStreamer pipeline.

    Raises:
        CaptureError: OpenCV cannot open it.

    """
    if not isinstance(device, (int, str)):
        return device
    import cv2

    pipeline = isinstance(device, str) and _PIPELINE in device
    video = cv2.VideoCapture(device, cv2.CAP_GSTREAMER if pipeline else cv2.CAP_ANY)
    if not video.isOpened():
        shown = _PASSWORD.sub("//***@", str(device))
        raise CaptureError(
            f"camera {name}: OpenCV cannot open '{shown}'; check that it is there and that no "
            "other program uses it; for a pipeline OpenCV must be built with GStreamer; or give "
            "an object with grab, retrieve and release as the device"
        )
    if isinstance(device, int):
        width, height = size_px
        video.set(cv2.CAP_PROP_FRAME_WIDTH, width)
        video.set(cv2.CAP_PROP_FRAME_HEIGHT, height)
        video.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # an image that waits in a queue is an old one
    return video

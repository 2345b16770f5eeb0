"""Locks automatic settings of a webcam through OpenCV; not tested with a real webcam."""

from collections.abc import Callable
from typing import Any

from servoid.source.controls import Controls
from servoid.source.delivery import Delivery

_MANUAL, _UNIT_S = 1.0, 1e-4  # of exposure, in the unit of the Linux kernel's drivers
_CLOSE = 0.02


class Webcam:
    """An OpenCV capture whose first image reports what the webcam refused."""

    def __init__(self, video: Any, controls: Controls) -> None:
        self._notices = lock_webcam(video, controls)
        self.grab: Callable[[], bool] = video.grab
        self.release: Callable[[], None] = video.release
        self._retrieve = video.retrieve

    def retrieve(self) -> tuple[bool, Any]:
        """Return the last grabbed image."""
        found, image = self._retrieve()
        notices, self._notices = self._notices, ()
        return found, Delivery((image,), notices=notices) if found and notices else image


def lock_webcam(video: Any, controls: Controls) -> tuple[str, ...]:
    """Apply settings, turn off automatic ones, and return what was refused.

    An exposure that is not given continues to adapt: when a webcam's automatic exposure is turned
    off, it falls back to a default, which may well be black.
    """
    import cv2

    settings: list[tuple[str, int, float | None]] = []
    if controls.lock:
        settings += [("autofocus", cv2.CAP_PROP_AUTOFOCUS, 0.0)]
        settings += [("automatic white balance", cv2.CAP_PROP_AUTO_WB, 0.0)]
    if controls.exposure_s is not None:
        settings += [("automatic exposure", cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)]
        settings += [("exposure", cv2.CAP_PROP_EXPOSURE, controls.exposure_s / _UNIT_S)]
    settings += [("gain", cv2.CAP_PROP_GAIN, controls.gain)]
    settings += [("focus", cv2.CAP_PROP_FOCUS, controls.focus)]
    settings += [("rate", cv2.CAP_PROP_FPS, controls.rate_hz)]
    messages = [_set(video, name, key, value) for name, key, value in settings if value is not None]
    return tuple(one for one in messages if one is not None)


def _set(video: Any, name: str, key: int, value: float) -> str | None:
    if not video.set(key, value):
        return f"the camera refuses {name} = {value:g}"
    kept = video.get(key)
    if abs(kept - value) > _CLOSE * max(abs(value), 1.0):
        return f"the camera took {name} = {kept:g} in place of {value:g}"
    return None

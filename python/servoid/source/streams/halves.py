"""Splits the images of one device into those of its two eyes."""

from collections.abc import Callable
from typing import Any

import numpy as np

from servoid.source.delivery import Delivery
from servoid.source.grabbing import Interruptible, Reopened, Triggered, Video


class HalvesVideo:
    """A device that delivers the images of two eyes side by side, the left eye's on the left.

    `open_device` opens it, and reopens it after a loss unless the device can do so itself.
    """

    def __init__(self, open_device: Callable[[], Video]) -> None:
        """Open the device."""
        self._open_device, self._video = open_device, open_device()

    def grab(self) -> bool:
        """Wait for the next image, and return whether there is one."""
        return self._video.grab()

    def retrieve(self) -> tuple[bool, Delivery | None]:
        """Return whether the image could be decoded, and its halves."""
        found, data = self._video.retrieve()
        if not found:
            return False, None
        whole = data if isinstance(data, Delivery) else Delivery((data,))
        if not whole.images:
            return True, whole
        pixels: Any = whole.images[0]
        width = np.asarray(pixels).shape[1] // 2
        return (
            True,
            Delivery(  # without the fields of subclasses, such as a JPEG file
                images=(pixels[:, :width], pixels[:, -width:]),
                stamp_s=whole.stamp_s,
                missing=whole.missing,
                notices=whole.notices,
            ),
        )

    def interrupt(self) -> None:
        """End a wait of the device for an image."""
        if isinstance(self._video, Interruptible):
            self._video.interrupt()

    def release(self) -> None:
        """Close the device."""
        self._video.release()

    @property
    def may_be_silent(self) -> bool:
        """Return whether the device awaits a trigger."""
        return isinstance(self._video, Triggered) and self._video.may_be_silent

    def reopened(self) -> "HalvesVideo":
        """Reopen the device."""
        again = self._video.reopened if isinstance(self._video, Reopened) else self._open_device
        return HalvesVideo(again)

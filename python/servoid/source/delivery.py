"""What a driver may report about its images, beyond their pixels."""

from dataclasses import dataclass
from typing import Any

from servoid.brief import brief
from servoid.errors import CaptureError


class LostDeviceError(CaptureError):
    """Raised by a driver whose device is gone: it is reopened at once, not after a delay."""


class EndedError(CaptureError):
    """Raised by a driver whose recording has ended: no further image will come."""


@dataclass(frozen=True, eq=False)
class Delivery:
    """The images that one device took at one instant, with their metadata.

    `images` are those of its eyes, (H, W) or (H, W, 3) uint8 or uint16, in BGR order, None where an
    eye has none; a delivery with notices only has no images. `stamp_s` is the capture time in
    seconds on the device's own clock, None if it has no clock. `depths` are in the pixels of the
    eyes, (H, W) float32, metres along z, NaN where unknown; empty if the device measures no depth.
    `missing` is the number of images that the device took since its previous delivery and did not
    deliver, None if it does not number them. `notices` are about this delivery, or about what
    preceded it.
    """

    images: tuple[Any, ...] = ()
    stamp_s: float | None = None
    depths: tuple[Any, ...] = ()
    missing: int | None = None
    notices: tuple[str, ...] = ()

    __repr__ = brief

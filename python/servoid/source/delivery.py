"""What a driver may say of the images it took, beyond their pixels."""

from dataclasses import dataclass
from typing import Any

from servoid.errors import CaptureError


class LostDeviceError(CaptureError):
    """Is raised by a driver whose device is gone: it is opened anew at once, not after a while."""


class EndedError(CaptureError):
    """Is raised by a driver that plays a recording which is over: no further image will come."""


@dataclass(frozen=True, eq=False)
class Delivery:
    """The images that one device took at one moment, and what it knows of them.

    `images` are those of its eyes, (H, W) or (H, W, 3) uint8 or uint16, blue first, None where an
    eye has none; a device with nothing but something to tell has no images. `stamp_s` is when they
    were taken, in seconds on the device's own clock, None where it has none. `depths` are in the
    pixels of the eyes, (H, W) float32, metres along z, NaN where unknown; none at all where the
    device measures none. `missing` is how many images the device took since its delivery before and
    did not deliver, None where it does not number them. `notices` are about this delivery, or about
    what came before it.
    """

    images: tuple[Any, ...] = ()
    stamp_s: float | None = None
    depths: tuple[Any, ...] = ()
    missing: int | None = None
    notices: tuple[str, ...] = ()

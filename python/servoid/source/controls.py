"""Camera settings that are fixed before it runs, so that nothing in it changes by itself."""

from typing import Annotated

from msgspec import Meta

from servoid.config import Checked
from servoid.errors import CaptureError


class Controls(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of a camera; None leaves a value as the camera has it, or lets it adapt once.

    With `lock`, exposure, gain, white balance and focus stay constant while images are taken.
    """

    REFUSAL = CaptureError

    lock: Annotated[bool, Meta(description="if nothing may change by itself")] = True
    exposure_s: (
        Annotated[float, Meta(gt=0, description="for which light is gathered, in seconds")] | None
    ) = None
    gain: (
        Annotated[float, Meta(ge=0, description="of the sensor, in the unit of the device")] | None
    ) = None
    focus: (
        Annotated[float, Meta(ge=0, description="of the lens, in the unit of the device")] | None
    ) = None
    rate_hz: Annotated[float, Meta(gt=0, description="images a second")] | None = None

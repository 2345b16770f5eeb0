"""What is asked of a camera before it runs: that nothing in it changes by itself."""

from typing import Annotated

from msgspec import Meta

from servoid.config.checked import Checked
from servoid.errors import CaptureError, ServoidError


class Controls(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Holds what a camera is set to; what is None stays as the camera has it, or adapts once.

    With `lock` neither exposure, gain, white balance nor focus change while images come.
    """

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return CaptureError(message)

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

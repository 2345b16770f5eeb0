"""What may go wrong in a world on purpose, so that a servo can show what it does then."""

from typing import Annotated

from msgspec import Meta

from servoid.config.checked import Checked
from servoid.errors import ServoidError, SimError

Start = Annotated[float, Meta(ge=0.0, description="when it begins, after the path began")]
Length = Annotated[float, Meta(gt=0.0, description="how long it lasts")]
Number = Annotated[int, Meta(ge=0, le=1)]
Which = Annotated[Number | None, Meta(description="0, the left camera, or 1; none: both")]


class SimSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Is the base of what is asked of a world."""

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return SimError(message)


class DropImages(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="drop"):
    """Lets images of one camera get lost, or whole observations."""

    at_s: Start
    seconds: Length
    camera: Which = None


class FreezeCamera(
    SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="freeze"
):
    """Lets a camera deliver its last image again and again, with new time stamps."""

    at_s: Start
    seconds: Length
    camera: Which = None


class Occlude(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="occlude"):
    """Slides a board before the object, and away again."""

    at_s: Start
    seconds: Length
    distance: Annotated[
        float, Meta(gt=0.0, description="from the object towards where the hand started, in m")
    ] = 0.2
    half_size: Annotated[
        tuple[float, float], Meta(description="half the board's width and height in m")
    ] = (0.22, 0.18)


class Teleport(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="teleport"):
    """Has the object be somewhere else from one moment on."""

    at_s: Start
    by: Annotated[
        tuple[float, float, float], Meta(description="along the object's axes at its start, in m")
    ] = (0.15, 0.0, 0.0)
    turn: Annotated[
        tuple[float, float, float], Meta(description="about those axes, a rotation vector in rad")
    ] = (0.0, 0.0, 0.0)


Fault = DropImages | FreezeCamera | Occlude | Teleport


def is_on(fault: DropImages | FreezeCamera | Occlude, since_start_s: float) -> bool:
    """Say if a fault lasts at a time after the path began."""
    return fault.at_s <= since_start_s < fault.at_s + fault.seconds


def concerns(fault: DropImages | FreezeCamera, camera: int) -> bool:
    """Say if a fault is one of this camera."""
    return fault.camera is None or fault.camera == camera

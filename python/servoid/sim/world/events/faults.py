"""Faults of a world, for tests of how servoing reacts to them."""

from typing import Annotated

from msgspec import Meta

from servoid.config import NEAR_M, Checked, Most
from servoid.errors import SimError

Start = Annotated[float, Meta(ge=0.0, description="when it begins, after the path began")]
Length = Annotated[float, Meta(gt=0.0, description="how long it lasts")]
Number = Annotated[int, Meta(ge=0, le=1)]
Which = Annotated[Number | None, Meta(description="0, the left camera, or 1; none: both")]


class SimSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The base class of faults."""

    REFUSAL = SimError


class DropImages(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="drop"):
    """Drops images of one camera, or whole observations."""

    at_s: Start
    seconds: Length
    camera: Which = None


class FreezeCamera(
    SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="freeze"
):
    """Freezes a camera: it repeats its last image, with new time stamps."""

    at_s: Start
    seconds: Length
    camera: Which = None


class Occlude(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="occlude"):
    """Moves a board in front of the object, and away again."""

    at_s: Start
    seconds: Length
    distance: Annotated[
        float,
        Most(NEAR_M),
        Meta(gt=0.0, description="from the object towards where the hand started, in m"),
    ] = 0.2
    half_size: Annotated[
        tuple[float, float],
        Most(NEAR_M),
        Meta(description="half the board's width and height in m"),
    ] = (0.22, 0.18)


class Teleport(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="teleport"):
    """Moves the object to another pose at once."""

    at_s: Start
    by: Annotated[
        tuple[float, float, float],
        Most(NEAR_M),
        Meta(description="along the object's axes at its start, in m"),
    ] = (0.15, 0.0, 0.0)
    turn: Annotated[
        tuple[float, float, float], Meta(description="about those axes, a rotation vector in rad")
    ] = (0.0, 0.0, 0.0)


Fault = DropImages | FreezeCamera | Occlude | Teleport


def is_on(fault: DropImages | FreezeCamera | Occlude, since_start_s: float) -> bool:
    """Return whether a fault is active at a time after the start of the path."""
    return fault.at_s <= since_start_s < fault.at_s + fault.seconds


def concerns(fault: DropImages | FreezeCamera, camera: int) -> bool:
    """Return whether a fault affects this camera."""
    return fault.camera is None or fault.camera == camera

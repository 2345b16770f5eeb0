"""For how long commands count, and how long either side waits for the other."""

from typing import Annotated

from msgspec import Meta

from servoid.config.checked import Checked
from servoid.errors import ServoError, ServoidError


class LinkSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How an arm is driven over a socket."""

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return ServoError(message)

    hold_s: Annotated[
        float, Meta(gt=0, description="after the state it answers, a command brakes, s")
    ] = 0.1
    braking_share: Annotated[
        float, Meta(gt=0.5, le=1, description="share of the accelerations with which it brakes")
    ] = 0.9
    first_s: Annotated[
        float, Meta(gt=0, description="in which the first command follows the start, s")
    ] = 1.0
    silence_s: Annotated[
        float, Meta(gt=0, description="on the wall, after which a silent driver is given up, s")
    ] = 1.0
    patience_s: Annotated[
        float, Meta(gt=0, description="on the wall, in which a driver must be there and start, s")
    ] = 10.0

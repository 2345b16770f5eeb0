"""Declares how long commands are valid, and how long either side waits for the other."""

from typing import Annotated

from msgspec import Meta

from servoid.config import Checked
from servoid.errors import ServoError


class LinkSettings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of the connection to an arm's driver."""

    REFUSAL = ServoError

    hold_s: Annotated[
        float,
        Meta(gt=0, description="time from a state until the command that answers it brakes, s"),
    ] = 0.1
    braking_share: Annotated[
        float, Meta(gt=0.5, le=1, description="share of the acceleration limits used to brake")
    ] = 0.9
    first_s: Annotated[
        float, Meta(gt=0, description="time allowed from the start to the first command, s")
    ] = 1.0
    silence_s: Annotated[
        float, Meta(gt=0, description="wall time after which a silent driver counts as gone, s")
    ] = 1.0
    patience_s: Annotated[
        float, Meta(gt=0, description="wall time allowed for a driver to answer and to start, s")
    ] = 10.0

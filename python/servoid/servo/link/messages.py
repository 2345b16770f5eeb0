"""The messages between the loop and an arm's driver: one JSON object per line.

| type | who | meaning |
|---|---|---|
| `welcome` | driver | once, when a loop has connected: the joints and their limits |
| `start` | loop | lets the arm move: repeats the `session` of the driver's states |
| `command` | loop | a motion from `stamp_s` on that ends at rest |
| `state` | driver | once per period: the joints' state, and the status of commands |
| `busy` | driver | another loop is driving; the connection is closed |

All times are those of the driver's clock. `stamp_s` of a command is `time_s` of the state that it
answers, so that no clocks need to be compared.
"""

from enum import Enum
from typing import Any, TypeVar

import msgspec

from servoid.errors import ServoError

VERSION = 1
Number = float | None  # null in JSON, for values that are not finite


class Phase(Enum):
    """What a driver is ready for."""

    WAITING = "waiting"
    RUNNING = "running"


class Welcome(msgspec.Struct, frozen=True, tag="welcome", kw_only=True):
    """Describes the joints to a loop: limits are (N,) in rad, rad/s, rad/s² and rad/s³."""

    version: int
    names: list[str]
    hand_count: int
    lower: list[float]
    upper: list[float]
    speed: list[float]
    acceleration: list[float]
    period_s: float
    jerk: list[float] | None = None


class Start(msgspec.Struct, frozen=True, tag="start"):
    """Lets the arm move, in the session that the driver's states show."""

    session: str


class MotionCommand(msgspec.Struct, frozen=True, tag="command", kw_only=True):
    """A motion that begins at `stamp_s` and ends at rest; see `StoppingTrajectory`.

    `number` increases from command to command of a session.
    """

    session: str
    number: int
    stamp_s: float
    times_s: list[float]
    speeds: list[list[float]]


class State(msgspec.Struct, frozen=True, tag="state", kw_only=True):
    """The state of the joints, (N,) in rad and rad/s, and the status of the commands.

    `resting` is true if the commanded speeds are zero and no motion is in progress, as a start
    requires. `accepted` is the number of the last accepted command, 0 before the first of a
    session; `missing` the count of numbers before it that never arrived, `refused` the count of
    refused commands by reason, and `ended` why the last session ended. `stopped` is true during a
    protective stop, in which no session starts.
    """

    session: str
    phase: Phase
    time_s: Number
    positions: list[Number]
    velocities: list[Number]
    resting: bool
    accepted: int
    missing: int
    refused: dict[str, int]
    ended: str = ""
    stopped: bool = False


class Busy(msgspec.Struct, frozen=True, tag="busy"):
    """Refuses a second loop."""


FromLoop = Start | MotionCommand
FromDriver = Welcome | State | Busy

_T = TypeVar("_T")
_ENCODER = msgspec.json.Encoder()
_FROM_LOOP: "msgspec.json.Decoder[FromLoop]" = msgspec.json.Decoder(FromLoop)
_FROM_DRIVER: "msgspec.json.Decoder[FromDriver]" = msgspec.json.Decoder(FromDriver)


def line_of(message: Any) -> bytes:
    """Return a message as a line; numbers that are not finite become null."""
    return _ENCODER.encode(message) + b"\n"


def from_loop(line: bytes) -> FromLoop | None:
    """Parse a message of a loop, None if it is malformed."""
    try:
        return _FROM_LOOP.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def from_driver(line: bytes) -> FromDriver:
    """Parse a message of a driver.

    Raises:
        ServoError: it is malformed.

    """
    try:
        return _FROM_DRIVER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as reason:
        shown = line[:80].decode(errors="replace")
        raise ServoError(
            f"the arm's driver sent an invalid message: {shown!r} ({reason}); is it a driver of "
            f"servoid's protocol, version {VERSION}?"
        ) from reason

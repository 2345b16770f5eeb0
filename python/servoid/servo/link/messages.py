"""What the loop and an arm's driver say to each other: one JSON object a line.

| type | who | meaning |
|---|---|---|
| `welcome` | driver | once, when a loop has connected: which joints there are, and how it counts |
| `start` | loop | let the arm move: answers the `session` that the driver's states show |
| `command` | loop | a motion that ends at rest, begun at `stamp_s` |
| `state` | driver | once in each of its periods: what the joints do, and what it made of commands |
| `busy` | driver | another loop is driving; the connection is closed |

All times are those of the driver's clock. `stamp_s` of a command is `time_s` of the state that it
answers, so that no clocks need be compared.
"""

from enum import Enum
from typing import Any, TypeVar

import msgspec

from servoid.errors import ServoError

VERSION = 1
Number = float | None  # JSON has no other word for what is no number


class Phase(Enum):
    """What a driver is ready for."""

    WAITING = "waiting"
    RUNNING = "running"


class Welcome(msgspec.Struct, frozen=True, tag="welcome", kw_only=True):
    """Tells a loop which joints there are: limits are (N,) in rad, rad/s, rad/s² and rad/s³."""

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
    """What the joints do, (N,) in rad and rad/s, and what the driver made of the commands.

    `resting` says if the joints are told to rest and no motion is under way, as a start asks for.
    `accepted` is the number of the last command that counts, 0 before the first of a session;
    `missing` how many numbers before it never came, `refused` how many commands were refused by
    reason, and `ended` why the last session is over. `stopped` says that the arm is in a protective
    stop, in which no session starts.
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
    """Return what a loop said, None if it is no message."""
    try:
        return _FROM_LOOP.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def from_driver(line: bytes) -> FromDriver:
    """Return what a driver said.

    Raises:
        ServoError: it is no message.

    """
    try:
        return _FROM_DRIVER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as reason:
        shown = line[:80].decode(errors="replace")
        raise ServoError(
            f"the arm's driver said what is no message: {shown!r} ({reason}); is it a driver of "
            f"servoid's protocol, version {VERSION}?"
        ) from reason

"""Reads the timestamp and frame of a message without decoding the rest, maybe a large image."""

import struct
from dataclasses import dataclass

from servoid.errors import CaptureError
from servoid.exchange.bags.stored.reader import Bag, Message

NS_PER_S = 1_000_000_000
_START = 4  # bytes before the header: a sequence number in ROS 1, the encoding in ROS 2
_MOST_NAME = 1024


@dataclass(frozen=True)
class Header:
    """When a message was measured, in nanoseconds, and in which frame."""

    stamp_ns: int
    frame: str


def read_header(bag: Bag, message: Message) -> Header:
    """Return the header of a message whose type begins with one.

    A timestamp of zero, which drivers without a clock write, is replaced by the recording time.

    Raises:
        CaptureError: the message is too short.

    """
    data = message.data
    is_little = bag.is_ros1 or (len(data) > 1 and bool(data[1] & 1))
    order = "<" if is_little else ">"
    try:
        seconds, nanoseconds, length = struct.unpack_from(
            f"{order}{'I' if bag.is_ros1 else 'i'}II", data, _START
        )
        if length > _MOST_NAME or _START + 12 + length > len(data):
            raise ValueError("the name of its frame exceeds the message")
        name = data[_START + 12 : _START + 12 + length].decode("utf-8")
    except (struct.error, ValueError) as reason:
        raise CaptureError(
            f"{bag.path}: a message on {message.at.topic} is damaged ({reason}); record it again"
        ) from reason
    stamp_ns = seconds * NS_PER_S + nanoseconds
    return Header(stamp_ns or message.at.log_ns, tidy_frame(name))


def tidy_frame(name: str) -> str:
    """Return the name of a frame in tf2's form: without a leading slash."""
    return name.rstrip("\0").lstrip("/")

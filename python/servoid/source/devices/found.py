"""A device that was found, and the list of devices in messages."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class FoundDevice:
    """A connected device: the name by which it opens, and its description."""

    name: str
    description: str


def describe_devices(devices: Iterable[FoundDevice]) -> str:
    """List devices in one sentence."""
    listed = "; ".join(f"{one.name} ({one.description})" for one in devices)
    return f"found: {listed}" if listed else "none was found"

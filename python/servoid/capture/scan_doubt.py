"""Reads what a scan that made a capture doubts of its own poses."""

from pathlib import Path

import msgspec

from servoid.capture.capture import Capture
from servoid.config import SETTINGS_FILE, read_bytes
from servoid.errors import CaptureError

SCAN_FIGURES = "scan.json"  # beside the capture.toml of a scan


class _Doubted(msgspec.Struct):
    """What scan.json says of the poses; files of earlier versions say nothing."""

    pose_doubts: list[str] = []


def scan_doubt(capture: Capture) -> str | None:
    """Return a message if the scan that made a capture doubts its own poses, else None."""
    pictures = (one for camera in capture.cameras for one in camera.pictures if one is not None)
    if any(one.is_in_memory for one in pictures):  # it is beside nothing
        return None
    doubts = _pose_doubts(capture.path.parent / SCAN_FIGURES)
    if not doubts:
        return None
    return f"the scan that found the poses doubts them: {'; '.join(doubts)}"


def _pose_doubts(figures: Path) -> list[str]:
    """Return the doubts in a scan's file; none in another one that only has its name."""
    try:
        content = read_bytes(figures, CaptureError, SETTINGS_FILE)
        return msgspec.json.decode(content, type=_Doubted).pose_doubts
    except (CaptureError, msgspec.MsgspecError):
        return []

"""Segmentation: targets, and the masks of the objects that they mean."""

from servoid.segment.doubts import Depth
from servoid.segment.finding import Found, find_object, seek_object, undoubted
from servoid.segment.segment import grow_mask
from servoid.segment.target import (
    BackgroundTarget,
    BoxTarget,
    ClickTarget,
    HueTarget,
    MaskTarget,
    Target,
    parse_target,
)

__all__ = [
    "BackgroundTarget",
    "BoxTarget",
    "ClickTarget",
    "Depth",
    "Found",
    "HueTarget",
    "MaskTarget",
    "Target",
    "find_object",
    "grow_mask",
    "parse_target",
    "seek_object",
    "undoubted",
]

"""Segmentation: targets, and the masks of the objects that they mean."""

from typing import TYPE_CHECKING

from servoid.renamed import refuse_old_names
from servoid.segment.borders import border_rank, fitting_shift
from servoid.segment.boxes import pixels_in, window_around
from servoid.segment.doubts import Depth, Parting, parted_by_depth
from servoid.segment.finding import Found, find_object, find_with_doubts, undoubted
from servoid.segment.hue import LEAST_SATURATION, LEAST_VALUE, hue_window, match_image
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
    "border_rank",
    "find_object",
    "find_with_doubts",
    "fitting_shift",
    "grow_mask",
    "parse_target",
    "undoubted",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(__name__, {"seek_object": "find_with_doubts"})

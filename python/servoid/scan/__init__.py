"""Estimates the poses and the calibration of images that come without either."""

from servoid.scan.footage import (
    Film,
    Footage,
    Photographs,
    Recorded,
    holds_photographs,
    image_name,
    is_footage,
    open_footage,
)
from servoid.scan.metres.board import Board, parse_board
from servoid.scan.metres.pair import Partner
from servoid.scan.metres.scale import Baseline, Length, Scale, parse_baseline, parse_length
from servoid.scan.request import Request
from servoid.scan.result import Scan
from servoid.scan.scanning import scan
from servoid.scan.solution import Solution
from servoid.scan.writing import CAMERA

__all__ = [
    "CAMERA",
    "Baseline",
    "Board",
    "Film",
    "Footage",
    "Length",
    "Partner",
    "Photographs",
    "Recorded",
    "Request",
    "Scale",
    "Scan",
    "Solution",
    "holds_photographs",
    "is_footage",
    "open_footage",
    "parse_baseline",
    "parse_board",
    "parse_length",
    "scan",
]

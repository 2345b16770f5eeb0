"""Reads and writes file formats of other programs."""

from servoid.exchange.bags import is_bag, open_bag
from servoid.exchange.calibrations.opening import calibration_files, read_tool_calibration
from servoid.exchange.calibrations.tables import ToolCalibration
from servoid.exchange.captures import bop, nerfstudio
from servoid.exchange.captures.bop import open_bop
from servoid.exchange.captures.colmap import open_colmap
from servoid.exchange.captures.nerfstudio import open_nerfstudio
from servoid.exchange.opening import holds_bag, holds_capture_file, is_capture, open_any

__all__ = [
    "is_bag",
    "is_capture",
    "open_any",
    "open_bag",
    "open_bop",
    "open_colmap",
    "open_nerfstudio",
]

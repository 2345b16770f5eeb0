"""Drivers of cameras that deliver more than pixels: industrial cameras and RealSense."""

from servoid.source.devices.found import FoundDevice
from servoid.source.devices.genicam import GenicamVideo, list_genicam, open_genicam
from servoid.source.devices.realsense import (
    RealSenseVideo,
    list_realsense,
    load_library,
    open_realsense,
)

__all__ = [
    "FoundDevice",
    "GenicamVideo",
    "RealSenseVideo",
    "list_genicam",
    "list_realsense",
    "open_genicam",
    "open_realsense",
]

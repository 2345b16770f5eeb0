"""Cameras and captures: what was seen, by which camera, from where."""

from servoid._native import Camera, Lens, View
from servoid.observe.capture import (
    Capture,
    CaptureCamera,
    CaptureView,
    Observation,
)
from servoid.observe.depth import read_depth
from servoid.observe.images import read_image, read_mask
from servoid.observe.opening import open_capture
from servoid.observe.picture import Picture
from servoid.observe.undistort import Undistortion, undistortion

__all__ = [
    "Camera",
    "Capture",
    "CaptureCamera",
    "CaptureView",
    "Lens",
    "Observation",
    "Picture",
    "Undistortion",
    "View",
    "open_capture",
    "read_depth",
    "read_image",
    "read_mask",
    "undistortion",
]

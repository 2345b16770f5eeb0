"""Cameras and captures: what was seen, by which camera, from where."""

from servoid._native import Camera, Lens, View
from servoid.observe.arrays import ArrayPicture, PosedImage, capture_of, views_of
from servoid.observe.capture import (
    Capture,
    CaptureCamera,
    CaptureView,
    Observation,
)
from servoid.observe.depth import read_depth
from servoid.observe.doubts import Depth
from servoid.observe.finding import Found, find_object, seek_object, undoubted
from servoid.observe.images import read_image, read_mask
from servoid.observe.instants import ASSUMED_HZ, cameras_of, read_instants, tidy_image
from servoid.observe.live import Live, LiveCamera, LiveSettings
from servoid.observe.looks import write_looks
from servoid.observe.opening import open_capture
from servoid.observe.picture import Picture
from servoid.observe.recording import Recording
from servoid.observe.rig_file import read_rig
from servoid.observe.segment import grow_mask
from servoid.observe.shrinking import shrunk
from servoid.observe.source import Instant, Source
from servoid.observe.stereo import StereoDepth, rough_depth, stereo_depth
from servoid.observe.target import (
    BackgroundTarget,
    BoxTarget,
    ClickTarget,
    HueTarget,
    MaskTarget,
    Target,
    parse_target,
)
from servoid.observe.undistort import Undistortion, undistortion

__all__ = [
    "ASSUMED_HZ",
    "ArrayPicture",
    "BackgroundTarget",
    "BoxTarget",
    "Camera",
    "Capture",
    "CaptureCamera",
    "CaptureView",
    "ClickTarget",
    "Depth",
    "Found",
    "HueTarget",
    "Instant",
    "Lens",
    "Live",
    "LiveCamera",
    "LiveSettings",
    "MaskTarget",
    "Observation",
    "Picture",
    "PosedImage",
    "Recording",
    "Source",
    "StereoDepth",
    "Target",
    "Undistortion",
    "View",
    "cameras_of",
    "capture_of",
    "find_object",
    "grow_mask",
    "open_capture",
    "parse_target",
    "read_depth",
    "read_image",
    "read_instants",
    "read_mask",
    "read_rig",
    "rough_depth",
    "seek_object",
    "shrunk",
    "stereo_depth",
    "tidy_image",
    "undistortion",
    "undoubted",
    "views_of",
    "write_looks",
]

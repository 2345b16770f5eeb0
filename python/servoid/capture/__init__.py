"""Captures: images, the cameras that took them, and the cameras' poses."""

from servoid._native import View
from servoid.capture.arrays import ArrayPicture, PosedImage, capture_of, views_of
from servoid.capture.calibration_doubt import doubt_calibration, doubt_for_model
from servoid.capture.capture import Capture, CaptureCamera, CaptureView, Observation
from servoid.capture.capture_file import (
    POSES_HEADER,
    LensEntry,
    MountedLens,
    Row,
    Version,
    check_reach,
    mounted_lenses,
    read_versioned,
)
from servoid.capture.edited_images import doubt_edited
from servoid.capture.examined import examined
from servoid.capture.exchanged import check_measurable, check_not_exchanged
from servoid.capture.matched_features import Features, alike, closest, features_on, of_one_motion
from servoid.capture.moved_cameras import MovedDoubt, doubt_moved
from servoid.capture.moving_rig import RigDoubt, doubt_rig_poses, examine_rig_poses
from servoid.capture.name_order import check_pictured_once, order_note
from servoid.capture.opening import count_uncalibrated, open_capture
from servoid.capture.pair_doubt import is_refuted
from servoid.capture.recorded_times import unordered_times
from servoid.capture.scan_doubt import SCAN_FIGURES
from servoid.capture.shrinking import shrunk
from servoid.capture.step_doubt import doubt_step
from servoid.capture.view_doubt import farthest_off

__all__ = [
    "ArrayPicture",
    "Capture",
    "CaptureCamera",
    "CaptureView",
    "MovedDoubt",
    "Observation",
    "PosedImage",
    "RigDoubt",
    "View",
    "capture_of",
    "count_uncalibrated",
    "doubt_calibration",
    "doubt_edited",
    "doubt_for_model",
    "doubt_moved",
    "doubt_rig_poses",
    "doubt_step",
    "examine_rig_poses",
    "farthest_off",
    "is_refuted",
    "open_capture",
    "shrunk",
    "views_of",
]

"""Opens any SOURCE: recorded ones as a capture, live ones as a live source."""

from typing import TYPE_CHECKING

from servoid.capture import doubt_calibration, doubt_for_model, doubt_rig_poses
from servoid.opening.filmed import Filmed, open_filmed
from servoid.opening.given_calibration import GivenCalibration, Rig, any_cameras
from servoid.opening.live import OpenedLive, open_live
from servoid.opening.openable import check_openable
from servoid.opening.own_files import belongs_to_source
from servoid.opening.recorded import Opened, count_uncalibrated_cameras, open_recorded
from servoid.opening.word import Kind, SourceWord, parse_source
from servoid.renamed import refuse_old_names

__all__ = [
    "Filmed",
    "GivenCalibration",
    "Kind",
    "Opened",
    "OpenedLive",
    "Rig",
    "SourceWord",
    "any_cameras",
    "belongs_to_source",
    "check_openable",
    "count_uncalibrated_cameras",
    "doubt_calibration",
    "doubt_for_model",
    "doubt_rig_poses",
    "open_filmed",
    "open_live",
    "open_recorded",
    "parse_source",
]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(
        __name__, {"Known": "GivenCalibration", "count_untold": "count_uncalibrated_cameras"}
    )

"""Bags: recordings of ROS 1 and ROS 2, read as captures and written as MCAP."""

from typing import TYPE_CHECKING

from servoid.exchange.bags.geometry.calibration import BagCalibrationSupplier, SuppliedCamera
from servoid.exchange.bags.opening import open_bag, why_uncalibrated
from servoid.exchange.bags.stored.reader import is_bag
from servoid.renamed import refuse_old_names

__all__ = ["BagCalibrationSupplier", "SuppliedCamera", "is_bag", "open_bag", "why_uncalibrated"]

if not TYPE_CHECKING:
    __getattr__ = refuse_old_names(
        __name__,
        {
            "Told": "BagCalibrationSupplier",
            "ToldCamera": "SuppliedCamera",
            "why_untold": "why_uncalibrated",
        },
    )

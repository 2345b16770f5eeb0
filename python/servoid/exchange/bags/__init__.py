"""Bags: recordings of ROS 1 and ROS 2, read as captures and written as MCAP."""

from servoid.exchange.bags.geometry.calibration import CalibrationSupplier, SuppliedCamera
from servoid.exchange.bags.opening import open_bag, why_uncalibrated
from servoid.exchange.bags.stored.reader import is_bag

__all__ = ["CalibrationSupplier", "SuppliedCamera", "is_bag", "open_bag", "why_uncalibrated"]

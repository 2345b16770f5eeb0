"""Bags: recordings of ROS 1 and ROS 2, read as captures and written as MCAP."""

from servoid.exchange.bags.geometry.calibration import Told, ToldCamera
from servoid.exchange.bags.opening import open_bag, why_untold
from servoid.exchange.bags.stored.reader import is_bag

__all__ = ["Told", "ToldCamera", "is_bag", "open_bag", "why_untold"]

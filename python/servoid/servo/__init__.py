"""Servoing: an arm that carries turning eyes is led to an object and kept there."""

from servoid.servo.arm import Arm, Eyes, Joints, JointState
from servoid.servo.controller import Command, Controller
from servoid.servo.safety import Reason
from servoid.servo.settings import (
    GazeMode,
    JointLaw,
    ServoSettings,
    read_settings,
    settings_from,
)
from servoid.servo.settings_text import settings_toml
from servoid.servo.target import TargetEstimate, TargetFilter

__all__ = [
    "Arm",
    "Command",
    "Controller",
    "Eyes",
    "GazeMode",
    "JointLaw",
    "JointState",
    "Joints",
    "Reason",
    "ServoSettings",
    "TargetEstimate",
    "TargetFilter",
    "read_settings",
    "settings_from",
    "settings_toml",
]

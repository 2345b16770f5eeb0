"""Formats numbers, rotations and documents for the XML of robot descriptions."""

import math
from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray


def numbers(values: Iterable[float]) -> str:
    """Return numbers separated by spaces."""
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)  # + 0.0 makes -0 a 0


def roll_pitch_yaw(rotation: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return angles with rotation (3, 3) = Rz(yaw) Ry(pitch) Rx(roll), in radians."""
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level > 1e-9:
        roll = math.atan2(rotation[2, 1], rotation[2, 2])
        return roll, pitch, math.atan2(rotation[1, 0], rotation[0, 0])
    # At a pitch of ±90 degrees, only the sum of roll and yaw is defined.
    return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0


def pose_numbers(matrix: NDArray[np.float64]) -> tuple[str, str]:
    """Return the translation of a pose (4, 4), and its roll, pitch and yaw."""
    return numbers(matrix[:3, 3]), numbers(roll_pitch_yaw(matrix[:3, :3]))


def document(root: ElementTree.Element) -> bytes:
    """Return an XML file, indented."""
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()

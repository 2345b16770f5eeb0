"""The toy is followed in other circumstances, with the body that was modelled in the first."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from faults import Moments
from numpy.typing import NDArray
from recordings import (
    SNAIL,
    Alone,
    Recording,
    pose_text,
    repaint,
    run_servoid,
    wrong,
)
from tracking_errors import tracking_errors

from servoid._native import Estimate
from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory
from servoid.sim import MovingScene, Scenario, write_moving_sample
from servoid.sim.convex import Floats

Recorded = Callable[[str], Recording]


class Pair(MovingScene):
    """A scene with two toys, that move as those of two seeds do."""

    def room_from_other(self, index: int) -> Floats:
        """Return the pose (4, 4) of the second toy in the room."""
        seed = self.scenario.seed + 1
        pose = MovingScene(Scenario(size="small", seed=seed)).room_from_object(index)
        pose[0, 3] += 0.16
        return pose

    def room_from_object(self, index: int) -> Floats:
        pose = super().room_from_object(index)
        pose[0, 3] -= 0.10
        return pose

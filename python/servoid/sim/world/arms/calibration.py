"""The calibration of head and cameras in the robot's software, with its errors."""

import numpy as np

from servoid._native import Camera
from servoid.pose import Floats, Pose
from servoid.servo import Eyes
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.arms.robot import Robot
from servoid.sim.world.lab import Lab


class Calibration:
    """Computes poses by the calibration of a laboratory; rendering uses the true ones."""

    def __init__(
        self, robot: Robot, kinematics: Kinematics, lab: Lab, true_cameras: tuple[Camera, ...]
    ) -> None:
        self._kinematics = kinematics
        self._head_from_true, right_from_true = lab.head_from_true, lab.right_from_true
        self.eyes: Eyes | None = _eyes(robot, self._head_from_true, right_from_true)
        self.cameras: tuple[Camera, ...] = tuple(
            lab.camera(one, number) for number, one in enumerate(true_cameras)
        )
        left, right = (_turn(*pair) for pair in zip(true_cameras, self.cameras, strict=True))
        self._eye_from_believed = (left, _joined(right_from_true, right))

    def world_from_eyes(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the calibrated poses of the cameras for these joint angles (N,)."""
        world_from_eyes = self._kinematics.world_from_eyes(positions)
        if any(self._eye_from_believed):
            world_from_eyes = tuple(
                world_from_eye if eye_from_believed is None else world_from_eye @ eye_from_believed
                for world_from_eye, eye_from_believed in zip(
                    world_from_eyes, self._eye_from_believed, strict=True
                )
            )
        if self._head_from_true is None:
            return world_from_eyes
        world_from_hand = self._kinematics.world_from_hand(positions)
        moved_from_world = world_from_hand @ self._head_from_true @ world_from_hand.inverse()
        return tuple(moved_from_world @ world_from_eye for world_from_eye in world_from_eyes)


def _joined(a_from_b: Pose | None, b_from_c: Pose | None) -> Pose | None:
    """Compose two motions, either of which may be None."""
    if a_from_b is None or b_from_c is None:
        return a_from_b or b_from_c
    return a_from_b @ b_from_c


def _turn(true: Camera, believed: Camera) -> Pose | None:
    """Return the rotation of a camera that compensates its principal point's error, or None.

    A calibration of both cannot separate one from the other, so the direction of the optical
    axis is preserved.
    """
    off = np.subtract(believed.center_px, true.center_px)
    if not off.any():
        return None
    right, down = off / believed.focal_px
    return Pose.exp([0.0, 0.0, 0.0, -down, right, 0.0])


def _eyes(robot: Robot, head: Pose | None, right: Pose | None) -> Eyes | None:
    """Return the calibrated joints of the cameras, None if the cameras are fixed."""
    if not robot.turns_eyes:
        return None
    count = robot.hand_count
    farther = 0.0 if right is None else right.translation[0]
    return Eyes(
        head or Pose.identity(),
        robot.half_baseline + 0.5 * farther,
        count,
        count + 1,
        count + 2,
    )

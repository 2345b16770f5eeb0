"""Solves inverse kinematics by damped Newton steps within the joints' limits."""

from typing import Protocol

import numpy as np

from servoid._native import change_between, newton_turn
from servoid.pose import Floats, Pose
from servoid.servo.arm import Joints

_TINY = 1e-9
_STEPS = 150
_REACHED = 1e-6  # m and rad
_STALLED = 1e-3  # share of the remaining error: shorter steps are blocked by a limit


class Chain(Protocol):
    """The geometry of an arm; see `Arm`."""

    @property
    def joints(self) -> Joints:
        """Return the joints and their limits."""
        ...

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions."""
        ...

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint."""
        ...


def stepped(
    arm: Chain, positions: Floats, world_from_goal: Pose, free: slice
) -> tuple[Floats, float]:
    """Return joints (N,) one step nearer to a goal, and their former distance, in m and rad.

    Only the `free` joints move.
    """
    change = change_between(arm.world_from_hand(positions), world_from_goal)
    error = float(np.abs(change).max())
    if error < _TINY:
        return positions, error
    slope = np.asarray(arm.jacobian(positions), np.float64)[:, free]
    moved = positions.copy()
    moved[free] += newton_turn(slope, change)
    return np.clip(moved, arm.joints.lower, arm.joints.upper), error


def reached(
    arm: Chain, world_from_goal: Pose, start: Floats, free: slice | None = None
) -> Floats | None:
    """Return joints (N,) within their limits with the hand at a goal, None if none are found.

    The search starts at `start` (N,); only the `free` joints move, by default all of the hand's.
    """
    free = free or slice(0, arm.joints.hand_count)
    positions = np.clip(start, arm.joints.lower, arm.joints.upper)
    for _ in range(_STEPS):
        moved, error = stepped(arm, positions, world_from_goal, free)
        if error < _REACHED:
            return moved
        if np.abs(moved - positions).max() < _STALLED * error:
            return None
        positions = moved
    return None

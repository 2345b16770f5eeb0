"""From a hand velocity to joint speeds: the paper's law, and what every such law answers."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from servoid.pose import Pose, exact
from servoid.servo.arm import Arm, Floats, JointState
from servoid.servo.law.reach import stepped
from servoid.servo.settings import JointSettings

IDLE_WEIGHT = 1e-3  # m²: of motion of the joints that leaves the hand where it is
_TINY = 1e-9


@dataclass(frozen=True, eq=False)
class HandWish:
    """What the hand should do: its velocity (6,) in the world, and the pose that it is led to."""

    twist: Floats
    world_from_goal: Pose


@dataclass(frozen=True, eq=False)
class JointWish:
    """What the joints should do: speeds (n,) in rad/s, and `weights` (n, n) of missing them.

    Of speeds that may be had, those are best whose difference x costs least in x weights x.
    """

    velocities: Floats
    weights: Floats


class HandJoints(Protocol):
    """A law that turns what the hand should do into what the joints that move it should do."""

    def wish(self, state: JointState, jacobian: Floats, wish: HandWish) -> JointWish:
        """Return what it wishes of n joints, bounds aside; `jacobian` is (6, n), of the hand's."""
        ...


def hand_weights(jacobian: Floats, angular_weight: float) -> Floats:
    """Return weights (n, n) for which joints that move the hand as desired are nearly all the same.

    `jacobian` is (6, n), and `angular_weight` says how many metres weigh as much as a radian.
    """
    weighted = np.repeat([1.0, angular_weight], 3)[:, None] * jacobian
    weights = exact.product(weighted.T, weighted)
    weights[np.diag_indices(len(weights))] += IDLE_WEIGHT
    return weights


def pseudo_inverse(jacobian: Floats) -> Floats:
    """Return (n, 6): the least joint speeds for a hand velocity, of a Jacobian (6, n)."""
    square = exact.product(jacobian, jacobian.T)
    # A trace of damping keeps exactly singular poses solvable.
    square[np.diag_indices(6)] += _TINY
    return exact.solve(square, jacobian).T  # Eq. (15)


class PaperJoints:
    """The paper's law: joints for the goal with the first one at 0, and the pseudo-inverse.

    An arm without a joint to spare has none held at 0.
    """

    def __init__(self, arm: Arm, settings: JointSettings) -> None:
        self._arm, self._settings = arm, settings
        count = arm.joints.hand_count
        self._free = slice(1 if count > 6 else 0, count)
        self._solution: Floats | None = None

    def wish(self, state: JointState, jacobian: Floats, wish: HandWish) -> JointWish:
        """Return what the law asks for, bounds aside."""
        count = self._arm.joints.hand_count
        desired = self.joints_at(wish.world_from_goal, state.positions)  # Eq. (14)
        feedback = self._settings.feedback_gain * (desired - state.positions)[:count]
        velocities = feedback + exact.product(pseudo_inverse(jacobian), wish.twist)  # Eq. (16)
        return JointWish(velocities, hand_weights(jacobian, self._settings.angular_weight))

    def joints_at(self, world_from_goal: Pose, positions: Floats) -> Floats:
        """Return the joints (N,) that hold the hand at the goal, as near as steps have come to it.

        Damped Newton steps start at the last solution, the first time at `positions` (N,). The
        first joint is at 0, and the eyes stay where they are.
        """
        arm, free = self._arm, self._free
        start = positions if self._solution is None else self._solution
        found = positions.copy()
        found[: arm.joints.hand_count] = start[: arm.joints.hand_count]
        found[: free.start] = 0.0
        for _ in range(self._settings.newton_steps):
            found, _ = stepped(arm, found, world_from_goal, free)
        self._solution = found
        return found

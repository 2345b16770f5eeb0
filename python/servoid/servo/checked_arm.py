"""Wraps an arm so that what its geometry returns is checked wherever it is used."""

import numpy as np

from servoid.errors import ServoError
from servoid.pose import Floats, Pose
from servoid.servo.arguments import check_jacobian, check_returned
from servoid.servo.arm import Arm, Clearances, Eyes, Joints, JointState, Shaped, Solid


class CheckedArm:
    """An arm whose poses, Jacobians and distances are of the right kinds and shapes.

    Numbers that are not finite pass: they hold the hand.
    """

    def __init__(self, arm: Arm) -> None:
        """Wrap an arm.

        Raises:
            ServoError: its shape is none.

        """
        self._arm = arm
        self.joints: Joints = arm.joints
        self.eyes: Eyes | None = arm.eyes
        self.period_s: float = arm.period_s
        solid = arm.solid if isinstance(arm, Shaped) else None
        self.solid: Solid | None = None if solid is None else _CheckedSolid(solid, arm.joints)

    def state(self) -> JointState:
        """Return the present state of the joints."""
        return self._arm.state()

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand for these joint positions.

        Raises:
            ServoError: the arm returns something else.

        """
        pose = self._arm.world_from_hand(positions)
        check_returned("Arm.world_from_hand", pose)
        return pose

    def jacobian(self, positions: Floats) -> Floats:
        """Return (6, N) float64: the hand's velocity, linear and angular in the world, by joint.

        Raises:
            ServoError: the arm returns something else.

        """
        jacobian = self._arm.jacobian(positions)
        check_jacobian(jacobian, self.joints)
        return np.asarray(jacobian, np.float64)

    def world_from_cameras(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the pose of each camera for these joint positions."""
        return self._arm.world_from_cameras(positions)

    def command(self, velocities: Floats) -> None:
        """Command the joint speeds (N,) in rad/s, and return one control period later."""
        self._arm.command(velocities)


class _CheckedSolid:
    """The shape of an arm whose distances and slopes are of the right shapes."""

    def __init__(self, solid: Solid, joints: Joints) -> None:
        if not callable(getattr(solid, "clearances", None)):
            raise ServoError(
                "Arm.solid must have a method clearances, as servoid.servo.Solid describes it, or "
                f"be None, but is {type(solid).__name__}"
            )
        self._solid, self._count = solid, len(joints.names)

    def clearances(self, positions: Floats, within: float) -> Clearances:
        """Return the distances of parts that are at most `within` from each other.

        Raises:
            ServoError: the shape returns something else.

        """
        found = self._solid.clearances(positions, within)
        if not (hasattr(found, "distances") and hasattr(found, "slopes")):
            raise ServoError(
                "Arm.solid.clearances must return servoid.servo.Clearances, but returned "
                f"{type(found).__name__}; if no parts are near, give 0 distances"
            )
        distances, slopes = np.shape(found.distances), np.shape(found.slopes)
        if len(distances) != 1 or slopes != (*distances, self._count):
            raise ServoError(
                f"Arm.solid.clearances returned distances of shape {distances} and slopes of shape "
                f"{slopes}; of K pairs of parts they must be (K,) and (K, {self._count}), with a "
                f"slope for each of the {self._count} joints"
            )
        near = np.asarray(found.distances) != np.inf  # the others need no bound
        return Clearances(
            np.asarray(found.distances, np.float64)[near],
            np.asarray(found.slopes, np.float64)[near],
        )

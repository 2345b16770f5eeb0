"""Time-dependent rigid motions with their first and second derivatives."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from servoid.pose import Floats, Pose, exact


def cross_matrix(vector: Floats) -> Floats:
    """Return the matrix (3, 3) of the cross product with a vector (3,)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def shifted_and_turned(pose: Pose, change: Floats) -> Pose:
    """Translate `a_from_b` by change[:3] and rotate it about b's origin by change[3:], in `a`."""
    turned = Pose.exp([0.0, 0.0, 0.0, *change[3:]]) @ pose
    return Pose.from_parts(np.add(pose.translation, change[:3]).tolist(), turned.quaternion)


def change_between(before: Pose, after: Pose) -> Floats:
    """Return translation and rotation (6,), in `a`, from one `a_from_b` to another."""
    change = (after @ before.inverse()).log()
    change[:3] = np.subtract(after.translation, before.translation)
    return change


@dataclass(frozen=True, eq=False)
class Moving:
    """A rigid motion `a_from_b` with its derivatives, all (4, 4) float64.

    `first` and `second` are the time derivatives of `matrix`, in 1/s and 1/s².
    """

    matrix: Floats
    first: Floats
    second: Floats

    @classmethod
    def at_rest(cls, pose: Pose) -> "Moving":
        """Return a constant motion."""
        return cls(pose.matrix(), np.zeros((4, 4)), np.zeros((4, 4)))

    @classmethod
    def from_twist(cls, pose: Pose, twist: Floats, acceleration: Floats | None = None) -> "Moving":
        """Return `a_from_b` with the velocity of b's origin and the angular velocity of b, in `a`.

        `twist` is (6,) in m/s and rad/s, `acceleration` its derivative, 0 if left out.
        """
        matrix = pose.matrix()
        first, second = np.zeros((4, 4)), np.zeros((4, 4))
        turning = cross_matrix(twist[3:])
        first[:3, :3] = exact.product(turning, matrix[:3, :3])
        first[:3, 3] = twist[:3]
        second[:3, :3] = exact.product(turning, first[:3, :3])
        if acceleration is not None:
            second[:3, :3] += exact.product(cross_matrix(acceleration[3:]), matrix[:3, :3])
            second[:3, 3] = acceleration[:3]
        return cls(matrix, first, second)

    @cached_property
    def pose(self) -> Pose:
        """Return the present pose."""
        return Pose(self.matrix)

    @property
    def twist(self) -> Floats:
        """Return the velocity of b's origin in m/s and of b's rotation in rad/s, (6,), in `a`."""
        turning = exact.product(self.first[:3, :3], self.matrix[:3, :3].T)
        angular = (turning[2, 1], turning[0, 2], turning[1, 0])
        return np.array([*self.first[:3, 3], *angular])

    def inverse(self) -> "Moving":
        """Return `b_from_a`."""
        inverse = Pose(self.matrix).inverse().matrix()
        first = -exact.product(inverse, self.first, inverse)
        second = exact.product(inverse, self.second, inverse)
        both = exact.product(first, self.first, inverse)
        return Moving(inverse, first, -second - 2.0 * both)

    def __matmul__(self, other: "Moving") -> "Moving":
        """Compose `a_from_b` with `b_from_c`, by the product rule."""
        product = exact.product
        return Moving(
            product(self.matrix, other.matrix),
            product(self.first, other.matrix) + product(self.matrix, other.first),
            product(self.second, other.matrix)
            + 2.0 * product(self.first, other.first)
            + product(self.matrix, other.second),
        )

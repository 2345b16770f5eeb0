"""What is true of the object of a simulated world, as far as anybody could see it."""

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Pose, exact
from servoid.sim.world import World


class Truth:
    """Says where a body truly is that was modelled of the object of a world.

    `object_from_body` is how the body's frame lies in the object's true one. An object that looks
    the same however it is spun has no true spin: of all poses that look alike, the one is true that
    is nearest to what is believed.
    """

    def __init__(self, world: World, object_from_body: Pose) -> None:
        self._world, self.object_from_body = world, object_from_body

    def at(self, time_s: float, believed: Pose | None) -> Pose:
        """Return `world_from_body` at a time, with the spin of what is believed where it is open.

        Without a belief it has the spin of the simulation.
        """
        world_from_object = self._world.world_from_object_at(time_s)
        axis = self._world.spin_axis
        if axis is not None and believed is not None:
            seen = believed @ self.object_from_body.inverse()
            world_from_object = spun_like(world_from_object, seen, np.array(axis))
        return world_from_object @ self.object_from_body


def spun_like(pose: Pose, other: Pose, axis: NDArray[np.float64]) -> Pose:
    """Return a pose spun about its own unit axis (3,) so that it is turned least from another."""
    w, *vector = (pose.inverse() @ other).quaternion
    angle = 2.0 * exact.arctan2(exact.dot(axis, np.array(vector)), w)
    return pose @ Pose.exp([0.0, 0.0, 0.0, *(angle * axis)])
